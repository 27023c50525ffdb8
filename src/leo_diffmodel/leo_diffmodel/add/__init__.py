# SPDX-License-Identifier: Apache-2.0
"""Add named effects to a model file, one by one or until nothing more is supported."""
