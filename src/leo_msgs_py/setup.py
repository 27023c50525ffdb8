# SPDX-License-Identifier: Apache-2.0
"""Package leo_msgs_py, for pip and for colcon."""

from setuptools import find_packages, setup

PACKAGE = 'leo_msgs_py'

setup(
    name=PACKAGE,
    version='0.1.0',
    description='Names, units, typed values, the node layer and the leo command',
    author='The LEO developers',
    license='Apache-2.0',
    python_requires='>=3.11',
    packages=find_packages(),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    install_requires=[
        'cyclonedds>=11.0,<12',
        'numpy>=1.26.4',
        'pyyaml',
        'rich',
        'rosbags>=0.11',
    ],
    extras_require={'test': ['pytest', 'hypothesis']},
    entry_points={
        'console_scripts': ['leo = leo_msgs_py.cli:main'],
        'leo.verbs': [
            f'{verb} = leo_msgs_py.verbs.{verb}:main'
            for verb in ('node', 'param', 'run', 'service', 'status', 'topic')
        ],
    },
    zip_safe=False,
)
