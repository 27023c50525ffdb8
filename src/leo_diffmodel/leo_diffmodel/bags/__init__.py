# SPDX-License-Identifier: Apache-2.0
"""Bags: recording, reading, playing, and importing foreign logs."""
