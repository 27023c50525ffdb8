# SPDX-License-Identifier: Apache-2.0
"""Messages that no honest node sends, which rclpy alone lets end the process."""

from __future__ import annotations

from rclpy.node import Node


def harden(node: Node) -> None:
    """Nothing yet."""
