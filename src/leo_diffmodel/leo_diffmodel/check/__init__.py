# SPDX-License-Identifier: Apache-2.0
"""Is a recording good enough, and for which effects? Everything here is known before a fit."""
