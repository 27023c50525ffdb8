# SPDX-License-Identifier: Apache-2.0
"""The laboratory: what examines the four packages of src. None of them imports it."""
