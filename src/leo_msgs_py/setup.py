# SPDX-License-Identifier: Apache-2.0
"""Package leo_msgs_py, for pip and for colcon."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

PACKAGE = 'leo_msgs_py'

setup(
    name=PACKAGE,
    version=ElementTree.parse('package.xml').findtext('version'),
    description='Names, units, typed values, help for nodes and the leo command',
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
    package_data={PACKAGE: ['py.typed', 'dds/*.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    install_requires=[
        'lz4',
        'mcap>=1.3',
        'numpy>=1.26.4',
        'pyyaml',
        'rich',
        'rosbags>=0.11',
        'setproctitle',
        'zstandard',
    ],
    extras_require={
        'ros': ['ros-jazzy-rclpy[fastrtps]==7.1.6', 'ros-jazzy-common-interfaces==5.3.6'],
        'test': ['pytest', 'hypothesis'],
    },
    entry_points={
        'console_scripts': ['leo = leo_msgs_py.cli:main'],
        'leo.verbs': [
            f'{verb} = leo_msgs_py.verbs.{verb}:main'
            for verb in ('node', 'param', 'run', 'service', 'status', 'topic')
        ],
    },
    zip_safe=False,
)
