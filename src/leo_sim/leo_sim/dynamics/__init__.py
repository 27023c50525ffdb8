# SPDX-License-Identifier: Apache-2.0
"""What turns torques into motion: trees, time stepping, impulses, the ground, PyBullet."""
