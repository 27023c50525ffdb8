# SPDX-License-Identifier: Apache-2.0
"""What is missing and in no catalogue: at which joint, which variable explains it, its curve."""
