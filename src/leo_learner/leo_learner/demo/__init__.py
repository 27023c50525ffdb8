# SPDX-License-Identifier: Apache-2.0
"""The main job of leo demo, in processes of its own."""
