# SPDX-License-Identifier: Apache-2.0
"""Deep deterministic policy gradient."""
