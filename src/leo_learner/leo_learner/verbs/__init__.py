# SPDX-License-Identifier: Apache-2.0
"""Verbs of the `leo` command: learn, play, demo."""
