# SPDX-License-Identifier: Apache-2.0
"""A robot folder made from a URDF: what it says, what is guessed, what is left to fill in."""
