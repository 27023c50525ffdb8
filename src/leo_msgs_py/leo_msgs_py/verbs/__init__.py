# SPDX-License-Identifier: Apache-2.0
"""The verbs of `leo` that look at and talk to the graph."""
