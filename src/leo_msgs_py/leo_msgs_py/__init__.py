# SPDX-License-Identifier: Apache-2.0
"""Names, units, typed values, help for nodes and the leo command."""
