# SPDX-License-Identifier: Apache-2.0
"""The data sheet of a motor: its constants, the friction law it needs, what else it does."""
