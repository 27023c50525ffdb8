# SPDX-License-Identifier: Apache-2.0
"""Foreign logs (CSV, JSON, MATLAB) to bags."""
