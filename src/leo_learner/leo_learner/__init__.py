# SPDX-License-Identifier: Apache-2.0
"""Environment, DDPG, Algorithm 5, policies, experiments and the learner node."""
