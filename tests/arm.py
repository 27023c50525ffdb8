# SPDX-License-Identifier: Apache-2.0
"""An arm with three joints in space."""

URDF = """
<robot name="arm">
  <link name="base"/>
  <joint name="yaw" type="continuous">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0.1 -0.2 0.3" rpy="0.3 -0.4 0.5"/><axis xyz="0.2 -0.4 1"/>
    <dynamics damping="0.01"/>
  </joint>
  <link name="upper"><inertial>
    <origin xyz="0.02 -0.05 0.11" rpy="0.3 -0.2 0.5"/><mass value="0.7"/>
    <inertia ixx="0.004" iyy="0.005" izz="0.003" ixy="0.0003" ixz="-0.0002" iyz="0.0001"/>
  </inertial></link>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="rail"/>
    <origin xyz="-0.1 0 0.1" rpy="0 0 1"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-0.05" upper="0.08" effort="1" velocity="1"/>
  </joint>
  <link name="rail"><inertial>
    <origin xyz="0.01 0.02 -0.03"/><mass value="0.4"/>
    <inertia ixx="0.002" iyy="0.0015" izz="0.001" ixy="0" ixz="0.0001" iyz="0"/>
  </inertial></link>
  <joint name="wrist" type="continuous">
    <parent link="rail"/><child link="hand"/>
    <origin xyz="0 0.1 0.1" rpy="1 0.2 -0.3"/><axis xyz="1 0 0"/>
  </joint>
  <link name="hand"><inertial>
    <origin xyz="0.03 0.04 0.05"/><mass value="0.3"/>
    <inertia ixx="0.001" iyy="0.0012" izz="0.0008" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
</robot>
"""
