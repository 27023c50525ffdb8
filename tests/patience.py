# SPDX-License-Identifier: Apache-2.0
"""How long a test waits for what must happen, on a machine however busy."""

PATIENCE = 600.0
"""s; nothing that passes takes it."""
