# SPDX-License-Identifier: Apache-2.0
"""Servos that do not exist: their bytes on a bus, with a simulated robot behind them."""
