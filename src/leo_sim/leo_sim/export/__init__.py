# SPDX-License-Identifier: Apache-2.0
"""A model as other simulators' descriptions: what these can hold, and what they cannot."""
