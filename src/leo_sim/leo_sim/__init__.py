# SPDX-License-Identifier: Apache-2.0
"""Robots, their effects, the model that predicts them, and the robot node."""
