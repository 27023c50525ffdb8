# SPDX-License-Identifier: Apache-2.0
"""Many robots of one kind, each explained by itself: who does the work, and who differs."""
