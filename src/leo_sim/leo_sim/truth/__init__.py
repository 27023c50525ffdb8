# SPDX-License-Identifier: Apache-2.0
"""What is hidden in a simulated robot, and how it is sealed."""
