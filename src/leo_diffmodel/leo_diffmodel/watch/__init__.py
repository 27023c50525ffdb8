# SPDX-License-Identifier: Apache-2.0
"""The live page: a robot, its model and switches for effects. What it shows, without a browser."""
