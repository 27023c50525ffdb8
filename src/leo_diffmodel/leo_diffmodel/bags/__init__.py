# SPDX-License-Identifier: Apache-2.0
"""Bags: recording, reading, playing, and importing foreign logs."""

from .recording import Episode, read_bag, Recording

__all__ = ['Episode', 'Recording', 'read_bag']
