# SPDX-License-Identifier: Apache-2.0
"""A running robot node as an environment."""
