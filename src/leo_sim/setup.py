# SPDX-License-Identifier: Apache-2.0
"""Package leo_sim, for pip and for colcon."""

from glob import glob
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

PACKAGE = 'leo_sim'
NODES = {'robot': 'leo_sim.nodes.robot:main', 'servo_bus': 'leo_sim.nodes.servo_bus:main'}

setup(
    name=PACKAGE,
    version=ElementTree.parse('package.xml').findtext('version'),
    description='Robots, motor law, effects, engines, the model and the robot node',
    long_description=Path('README.md').read_text(),
    long_description_content_type='text/markdown',
    author='The LEO developers',
    license_expression='Apache-2.0',
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Science/Research',
        'Operating System :: POSIX :: Linux',
        'Programming Language :: Python :: 3.11',
        'Programming Language :: Python :: 3.12',
        'Topic :: Scientific/Engineering',
        'Typing :: Typed',
    ],
    python_requires='>=3.11',
    packages=find_packages(),
    package_data={
        PACKAGE: [
            'py.typed',
            'description/robots/*/*',
            'description/robots/*/models/*.yaml',
            'description/servos/*.yaml',
            'description/servos/models/*.yaml',
        ]
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'lib/{PACKAGE}', glob('scripts/*')),  # where ros2 run looks
        (f'share/{PACKAGE}/launch', glob('launch/*.launch.py')),
        (f'share/{PACKAGE}/config', glob('config/*.yaml')),
    ],
    install_requires=[
        'leo_msgs_py',
        'joblib>=1.5',
        'mcap>=1.2',
        'numba>=0.60',
        'numpy>=1.26.4',
        'pydantic>=2.9',
        'pyyaml',
        'scipy>=1.11',
    ],
    extras_require={
        'bullet': ['pybullet>=3.2.7'],
        'mujoco': ['mujoco>=3.12,<4'],
        'servos': ['dynamixel-sdk>=4.1', 'feetech-servo-sdk>=1.0'],
        'test': ['pytest', 'hypothesis', 'mujoco<4'],
    },
    entry_points={
        'leo.executables': [f'{PACKAGE}.{n} = {t}' for n, t in NODES.items()],
        'leo.verbs': [
            'check-driver = leo_sim.verbs.check_driver:main',
            'reveal = leo_sim.verbs.reveal:main',
            'robot = leo_sim.verbs.robot:main',
        ],
        'leo.robots': [
            'pendulum = leo_sim.description.robots:PENDULUM',
            'torque_pendulum = leo_sim.description.robots:TORQUE_PENDULUM',
            'leo = leo_sim.description.robots:LEO',
            'leo_ode = leo_sim.description.robots:LEO_ODE',
            'servo_pendulum = leo_sim.description.robots:SERVO_PENDULUM',
            'xl330_pendulum = leo_sim.description.robots:XL330_PENDULUM',
            'so101 = leo_sim.description.robots:SO101',
            'double_pendulum = leo_sim.description.robots:DOUBLE_PENDULUM',
        ],
        'leo.drivers': [
            'simulated = leo_sim.drivers.simulated:SimulatedDriver',
            'dynamixel = leo_sim.drivers.dynamixel:DynamixelDriver',
            'feetech = leo_sim.drivers.feetech:FeetechDriver',
            'replay = leo_sim.drivers.replay:ReplayDriver',
        ],
        'leo.effects': [],
    },
    zip_safe=False,
)
