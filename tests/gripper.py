# SPDX-License-Identifier: Apache-2.0
"""Grippers, whose joints mimic each other: one motor moves all of them."""

SLIDES = """
<robot name="g"><link name="base"/>
<link name="l"><inertial><mass value="0.1"/>
<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="r"><inertial><mass value="0.1"/>
<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="left" type="prismatic"><parent link="base"/><child link="l"/><axis xyz="1 0 0"/>
<limit lower="0" upper="0.05" effort="10" velocity="1"/></joint>
<joint name="right" type="prismatic"><parent link="base"/><child link="r"/><axis xyz="-1 0 0"/>
<limit lower="0" upper="0.05" effort="10" velocity="1"/><mimic joint="left"/></joint></robot>
"""
"""Two fingers that slide apart."""
CLAW = """
<robot name="claw"><link name="base"/>
<link name="thumb"><inertial><origin xyz="0.02 0 -0.05"/><mass value="0.1"/>
<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="finger"><inertial><origin xyz="-0.01 0.02 -0.04"/><mass value="0.15"/>
<inertia ixx="1e-4" iyy="2e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tip"><inertial><origin xyz="0 0 -0.02"/><mass value="0.05"/>
<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="wheel"><inertial><origin xyz="0.01 0 0"/><mass value="0.02"/>
<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="bend" type="revolute"><parent link="finger"/><child link="tip"/>
<origin xyz="0 0 -0.08"/><axis xyz="0 1 0.2"/><limit lower="-2.5" upper="2.5"/>
<dynamics damping="0.004"/><mimic joint="right" multiplier="0.5" offset="0.1"/></joint>
<joint name="right" type="revolute"><parent link="base"/><child link="finger"/>
<origin xyz="-0.03 0 0" rpy="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5"/>
<mimic joint="left" multiplier="-1"/></joint>
<joint name="left" type="revolute"><parent link="base"/><child link="thumb"/>
<origin xyz="0.03 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2.5" upper="2.5" effort="0.3" velocity="20"/><dynamics damping="0.002"/></joint>
<joint name="spin" type="continuous"><parent link="tip"/><child link="wheel"/>
<origin xyz="0 0 -0.03"/><axis xyz="1 0 0"/><limit effort="0.05" velocity="20"/></joint></robot>
"""
"""A thumb, a finger that goes the other way, its tip that bends half as far, a wheel on it."""
