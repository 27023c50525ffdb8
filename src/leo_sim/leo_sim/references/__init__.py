# SPDX-License-Identifier: Apache-2.0
"""Independent integrators of the same laws, to compare with."""
