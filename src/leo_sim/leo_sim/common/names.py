# SPDX-License-Identifier: Apache-2.0
"""The nearest known name, as nodes say it too."""

from leo_msgs_py.names import nearest

__all__ = ['nearest']
