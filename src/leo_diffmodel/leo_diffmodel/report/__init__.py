# SPDX-License-Identifier: Apache-2.0
"""The report people read: one HTML file that works offline."""
