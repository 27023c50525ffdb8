# SPDX-License-Identifier: Apache-2.0
"""The model of a robot as an environment, and what episodes on it did."""
