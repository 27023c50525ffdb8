# SPDX-License-Identifier: Apache-2.0
"""Pictures of a robot from its bags: a strip of poses, an animation."""
