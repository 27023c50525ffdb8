# SPDX-License-Identifier: Apache-2.0
"""What it costs that a format cannot hold all of a model, on recordings."""
