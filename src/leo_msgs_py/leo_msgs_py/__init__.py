# SPDX-License-Identifier: Apache-2.0
"""Names, units, typed values, the node layer and the leo command."""
