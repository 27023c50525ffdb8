# SPDX-License-Identifier: Apache-2.0
"""The node layer: rclpy's calls on rclpy itself or on plain DDS (see `node.api`)."""
