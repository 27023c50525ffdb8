# SPDX-License-Identifier: Apache-2.0
"""Package leo_learner, for pip and for colcon."""

from glob import glob
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

PACKAGE = 'leo_learner'
NODES = {'learner': 'leo_learner.nodes.learner:main'}

setup(
    name=PACKAGE,
    version=ElementTree.parse('package.xml').findtext('version'),
    description='Environment, DDPG, Algorithm 5, policies, the demo, learner node',
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
    package_data={PACKAGE: ['py.typed', 'policies/*.safetensors', 'quick/*', 'quick/bag/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'lib/{PACKAGE}', glob('scripts/*')),  # where ros2 run looks
        (f'share/{PACKAGE}/launch', glob('launch/*.launch.py')),
        (f'share/{PACKAGE}/config', glob('config/*.yaml')),
    ],
    install_requires=[
        'leo_diffmodel[learn]',
        'leo_msgs_py',
        'leo_sim[bullet]',
        'gymnasium>=1.0',
        'numba>=0.60',
        'numpy>=1.26.4',
        'rich',
        'tensorboard',
        'threadpoolctl',
    ],
    extras_require={'test': ['pytest', 'hypothesis']},
    entry_points={
        'leo.executables': [f'{PACKAGE}.{n} = {t}' for n, t in NODES.items()],
        'leo.verbs': [
            f'{verb} = leo_learner.verbs.{verb}:main'
            for verb in ('datasheet', 'demo', 'learn', 'play')
        ],
    },
    zip_safe=False,
)
