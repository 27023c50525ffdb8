# SPDX-License-Identifier: Apache-2.0
"""What a robot is: its URDF, robot.yaml and servos, checked; the robots that ship."""
