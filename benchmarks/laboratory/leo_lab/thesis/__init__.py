# SPDX-License-Identifier: Apache-2.0
"""The thesis' tables and figures, as experiments that are run again case by case."""
