# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 wire protocol on plain DDS: names, types, hashes, QoS, graph, services."""
