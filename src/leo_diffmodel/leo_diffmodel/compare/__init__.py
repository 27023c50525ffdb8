# SPDX-License-Identifier: Apache-2.0
"""Compare a model with recordings: how wrong, where, and how much of it is only noise."""
