# SPDX-License-Identifier: Apache-2.0
"""Laws that are in no catalogue, one effect file each: cases that must come out unknown."""
