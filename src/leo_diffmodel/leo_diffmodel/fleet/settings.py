# SPDX-License-Identifier: Apache-2.0
"""The number by which a robot of a fleet stands out."""

SPREADS = 3.5
"""Robust standard deviations of the fleet (1.4826 times the median absolute deviation) from its
median: beyond them a value is an outlier (Iglewicz and Hoaglin 1993), one in 2000 normal ones."""
NORMAL = 1.4826  # standard deviation of normal values, by their median absolute deviation
