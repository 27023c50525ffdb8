# SPDX-License-Identifier: Apache-2.0
"""The main job, and the thesis' tables and figures as commands that redo them."""
