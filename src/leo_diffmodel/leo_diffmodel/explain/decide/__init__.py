# SPDX-License-Identifier: Apache-2.0
"""From the evidence to a verdict."""
