# SPDX-License-Identifier: Apache-2.0
"""Robots, motor law, effects, engines, the model and the robot node."""
