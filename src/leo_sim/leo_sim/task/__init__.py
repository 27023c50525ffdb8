# SPDX-License-Identifier: Apache-2.0
"""What a robot is to do: observation, reward and end of an episode; scripted motions."""
