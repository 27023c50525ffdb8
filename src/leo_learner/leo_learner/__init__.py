# SPDX-License-Identifier: Apache-2.0
"""Environment, DDPG, Algorithm 5, policies, the demo and the learner node."""
