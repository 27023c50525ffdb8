# SPDX-License-Identifier: Apache-2.0
"""Who does independent pieces of work: processes of this machine, or workers of a Dask cluster."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
import logging
from typing import Any, NamedTuple, TypeVar

from leo_msgs_py.errors import one_line, UserError
from leo_sim.common.cores import in_processes

Item = TypeVar('Item')
Result = TypeVar('Result')
CONNECT, FIRST_WORKER = 10.0, 60.0  # s
GO_ON = 'what was done is kept, and the same command goes on'


class Workers(NamedTuple):
    jobs: int = 1  # processes of this machine
    scheduler: str | None = None  # of Dask, whose workers take their place: tcp://HOST:PORT

    def each(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
        """The function of each item, as they come; UserError at the end where some were lost."""
        if not items:
            return iter(())
        if self.scheduler is None:
            return _by_processes(function, items, min(self.jobs, len(items)))
        return _by_cluster(function, items, self.scheduler)


def _by_processes(
    function: Callable[[Item], Result], items: Sequence[Item], jobs: int
) -> Iterator[Result]:
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    try:
        yield from in_processes(jobs, function, items, return_as='generator_unordered')
    except TerminatedWorkerError as error:
        raise UserError(f'a process was killed, for memory perhaps; {GO_ON}') from error


def _by_cluster(
    function: Callable[[Item], Result], items: Sequence[Item], address: str
) -> Iterator[Result]:
    """By futures of `distributed`; what is lost with a worker that dies is tried again alone."""
    given_up = 0
    with _client(address) as client:
        try:
            for item in (yield from _tried(client, function, items)):
                given_up += len((yield from _tried(client, function, [item])))
        except (distributed().client.FutureCancelledError, OSError) as error:
            raise UserError(f'the scheduler at {address} has left; {GO_ON}') from error
    if given_up:
        raise UserError(
            f'{given_up} of {len(items)} pieces of work were given up, as their '
            f'workers died again and again, for memory perhaps; {GO_ON}'
        )


def _tried(
    client: Any, function: Callable[[Item], Result], items: Sequence[Item]
) -> Generator[Result, None, list[Item]]:
    """The function of each item, as they come; those that were lost with their workers."""
    dask, lost = distributed(), []
    asked = dict(zip(client.map(function, items, pure=False), items, strict=True))
    for future in dask.as_completed(asked, loop=client.loop):
        try:
            yield future.result()
        except dask.scheduler.KilledWorker:
            lost.append(asked[future])
        future.release()
    return lost


@contextmanager
def _client(address: str) -> Iterator[Any]:
    """A client of a scheduler that has a worker; each works on one thing at a time."""
    dask = distributed()
    logging.getLogger('distributed.client').setLevel(logging.CRITICAL)  # we say it in one line
    try:
        client = dask.Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UserError(
            f'--scheduler {address}: no Dask scheduler answers there '
            f'({one_line(error)}); dask scheduler starts one'
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=FIRST_WORKER)
        except TimeoutError as error:
            raise UserError(
                f'--scheduler {address} has no worker; start some: '
                f'dask worker {address} --nworkers 8 --nthreads 1'
            ) from error
        if max(client.nthreads().values()) > 1:
            raise UserError(
                f'--scheduler {address} has workers of several threads; start them '
                'with --nthreads 1, and more of them'
            )
        yield client


def distributed() -> Any:
    try:
        import distributed as package
    except ImportError as error:
        raise UserError(
            "--scheduler needs the package distributed: pip install 'leo_diffmodel[cluster]'"
        ) from error
    return package
