# SPDX-License-Identifier: Apache-2.0
"""Choose a set of effects by how well it predicts what it was not fitted to."""
