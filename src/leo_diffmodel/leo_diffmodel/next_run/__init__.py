# SPDX-License-Identifier: Apache-2.0
"""Which run to record next: the one that parts what the data so far leave open."""
