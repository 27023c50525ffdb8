# SPDX-License-Identifier: Apache-2.0
"""A training run in a folder, and the policy it leaves."""
