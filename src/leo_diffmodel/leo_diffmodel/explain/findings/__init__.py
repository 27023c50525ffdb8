# SPDX-License-Identifier: Apache-2.0
"""Everything an answer is told from: nothing is fitted or predicted after this."""
