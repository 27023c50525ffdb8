# SPDX-License-Identifier: Apache-2.0
"""What in a recording is not the robot: shoves, hands, stops, gaps, sensors at their end."""
