# SPDX-License-Identifier: Apache-2.0
"""The live page in the browser: what each part of it shows, and the server behind it."""
