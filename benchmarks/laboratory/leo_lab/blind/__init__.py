# SPDX-License-Identifier: Apache-2.0
"""The blind benchmark: robots with an effect drawn by seed, explained from their bags alone."""
