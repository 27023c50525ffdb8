# SPDX-License-Identifier: Apache-2.0
"""What every room uses: names in messages, YAML, user code, compilation, broadcasting."""
