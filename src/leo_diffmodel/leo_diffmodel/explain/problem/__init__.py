# SPDX-License-Identifier: Apache-2.0
"""What is asked: recordings as windows with their noise, and the effects that may be missing."""
