# SPDX-License-Identifier: Apache-2.0
"""What every agent shares: the loop of episodes and the replay buffer."""
