# SPDX-License-Identifier: Apache-2.0
"""A running robot as what the page shows: the last seconds of its messages, and how it is."""
