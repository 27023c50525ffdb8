# SPDX-License-Identifier: Apache-2.0
"""Bags, compare, explain, add, the difference model and its node."""
