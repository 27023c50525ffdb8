# SPDX-License-Identifier: Apache-2.0
"""Package leo_diffmodel, for pip and for colcon."""

from glob import glob
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

PACKAGE = 'leo_diffmodel'
NODES = {'diffmodel': 'leo_diffmodel.nodes.diffmodel:main'}

setup(
    name=PACKAGE,
    version=ElementTree.parse('package.xml').findtext('version'),
    description='Bags, compare, explain, add, the difference model and its node',
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
    package_data={PACKAGE: ['py.typed', 'report/templates/*', 'bags/maps/*', 'faults/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'lib/{PACKAGE}', glob('scripts/*')),  # where ros2 run looks
        (f'share/{PACKAGE}/launch', glob('launch/*.launch.py')),
        (f'share/{PACKAGE}/config', glob('config/*.yaml')),
    ],
    install_requires=[
        'leo_msgs_py',
        'leo_sim',
        'bokeh>=3.4',
        'jinja2>=3.1',
        'joblib>=1.5',
        'lz4',
        'matplotlib',
        'mcap>=1.3',
        'numpy>=1.26.4',
        'pillow>=10.1',
        'pyarrow>=14',
        'pydantic>=2',
        'pyyaml',
        'rich',
        'rosbags>=0.11',
        'scipy>=1.11',
        'zstandard',
    ],
    extras_require={
        'cluster': ['distributed>=2024.8'],
        'logs': ['h5py>=3.10', 'mcap-protobuf-support>=0.5', 'zarr>=3'],
        'learn': ['safetensors', 'torch>=2.5,<2.14'],
        'test': ['pytest', 'hypothesis'],
    },
    entry_points={
        'leo.executables': [f'{PACKAGE}.{n} = {t}' for n, t in NODES.items()],
        'leo.verbs': [
            'bag = leo_diffmodel.verbs.bag:main',
            'import = leo_diffmodel.verbs.import_logs:main',
            'compare = leo_diffmodel.verbs.compare:main',
            'explain = leo_diffmodel.verbs.explain:main',
            'add = leo_diffmodel.verbs.add:main',
            'repair = leo_diffmodel.verbs.repair:main',
            'check = leo_diffmodel.verbs.check:main',
            'next = leo_diffmodel.verbs.next:main',
            'watch = leo_diffmodel.verbs.watch:main',
            'export = leo_diffmodel.verbs.export:main',
        ],
        'leo.log_formats': [],
    },
    zip_safe=False,
)
