# SPDX-License-Identifier: Apache-2.0
"""The effects of one model in their order: commands, motors, joint torques, sensors."""
