# SPDX-License-Identifier: Apache-2.0
"""What a result may depend on: the processor, the kernels made for it, and the seed."""

import os
from pathlib import Path
import platform
import re

import llvmlite.binding
import numpy  # noqa: F401  its BLAS
import scipy.linalg  # noqa: F401  and the other
from threadpoolctl import threadpool_info


def described(seed: object) -> list[str]:
    """What repeats a run: lines of processor, kernel of BLAS, numba's target, hypothesis' seed."""
    kernels = {
        f'{pool["architecture"]} ({pool["internal_api"]} {pool["version"]})'
        for pool in threadpool_info()
        if pool['user_api'] == 'blas'
    }
    host = llvmlite.binding.get_host_cpu_name()
    numba = os.environ.get('NUMBA_CPU_NAME')
    return [
        f'processor: {_processor()}, {os.cpu_count()} cores',
        f'kernel of BLAS: {", ".join(sorted(kernels))}',
        f'numba compiles for: {numba or host}' + f' (on {host})' * (numba is not None),
        f'to repeat hypothesis: --hypothesis-seed={seed}',
    ]


def _processor() -> str:
    cpuinfo = Path('/proc/cpuinfo')
    found = re.search(r'model name\s*: (.+)', cpuinfo.read_text() if cpuinfo.exists() else '')
    return found[1] if found else platform.processor() or platform.machine()
