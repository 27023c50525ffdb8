# SPDX-License-Identifier: Apache-2.0
from setuptools import find_packages, setup

setup(
    name='leo_msgs_py',
    version='0.1.0',
    packages=find_packages(),
    package_data={'': ['py.typed']},
    license='Apache-2.0',
    zip_safe=False,
)
