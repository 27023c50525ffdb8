# SPDX-License-Identifier: Apache-2.0
"""The answer in words, rows and error tables."""
