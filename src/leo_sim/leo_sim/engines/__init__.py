# SPDX-License-Identifier: Apache-2.0
"""Engines: what turns torques into motion."""
