# SPDX-License-Identifier: Apache-2.0
"""Workers of a Dask cluster on this machine, each a process of one thread."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from tests.patience import PATIENCE


@contextmanager
def local_cluster(workers: int) -> Iterator[Any]:
    """A scheduler with so many workers; skips a test where `distributed` is not installed.

    A worker that is killed starts again, however long a busy machine takes for that.
    """
    distributed = pytest.importorskip('distributed', reason='benchmarks/requirements-cluster.txt')
    import dask

    patient = dask.config.set({'distributed.deploy.lost-worker-timeout': PATIENCE})
    with (
        patient,
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            host='127.0.0.1',
            dashboard_address=None,
            silence_logs=50,
        ) as cluster,
    ):
        yield cluster
