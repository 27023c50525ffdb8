# SPDX-License-Identifier: Apache-2.0
"""Real rigs on which `leo explain` is compared with what a person would use instead."""
