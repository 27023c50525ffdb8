# SPDX-License-Identifier: Apache-2.0
"""Foreign logs (CSV, JSON, MATLAB) to bags."""

from .convert import import_logs

__all__ = ['import_logs']
