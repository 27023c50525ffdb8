# SPDX-License-Identifier: Apache-2.0
"""All that an answer is made of: nothing is fitted or predicted after this."""
