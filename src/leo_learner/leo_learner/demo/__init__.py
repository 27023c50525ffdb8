# SPDX-License-Identifier: Apache-2.0
"""The main job, `leo demo`: find, repair and retrain, on a robot with a secret."""
