# SPDX-License-Identifier: Apache-2.0
"""Nodes of leo_sim: thin, they move messages."""
