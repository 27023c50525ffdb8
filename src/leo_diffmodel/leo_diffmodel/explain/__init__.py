# SPDX-License-Identifier: Apache-2.0
"""Name the physical effect a model lacks, or say that none, or no known one, is missing."""
