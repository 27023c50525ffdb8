# SPDX-License-Identifier: Apache-2.0
"""Verbs of the `leo` command where the laboratory is installed: blind, reproduce."""
