# SPDX-License-Identifier: Apache-2.0
"""The thesis' baseline SARSA, and Sym, LEO walking with three voltages."""
