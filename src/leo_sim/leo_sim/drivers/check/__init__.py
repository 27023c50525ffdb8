# SPDX-License-Identifier: Apache-2.0
"""The contract of drivers.base as trials that any driver can be put to."""
