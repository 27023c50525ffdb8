# SPDX-License-Identifier: Apache-2.0
"""Fit hypotheses to windows: smooth motion by multiple shooting, contact by settled windows."""
