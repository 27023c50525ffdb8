# SPDX-License-Identifier: Apache-2.0
"""A training run in a folder: curves, checkpoints, progress, the policy file at the end."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
import signal
import threading
import time
from types import FrameType

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from torch.utils.tensorboard import SummaryWriter

from leo_learner.learning.checkpoint import load_checkpoint, PREFIX, save_checkpoint
from leo_learner.learning.policy import save_policy
from leo_learner.training.loop import OnScalar, TrainingLoop
from leo_msgs_py.console import Terminal
from leo_sim.description.robot import Robot

SAVE_PERIOD = 30.0
"""Wall time between two checkpoints [s]; one more is written at the end and at Ctrl-C."""
POLICY = 'policy.safetensors'


@dataclass(frozen=True)
class Outcome:
    policy: Path  # the best one by test
    test_return: float  # its mean return there
    steps: int  # transitions gathered
    seconds: float  # wall time of this part of the run
    finished: bool  # False where it was stopped before its last step, or before that was tested
    interrupted: bool  # by Ctrl-C (or SIGTERM)


def learn(
    training: TrainingLoop,
    robot: Robot,
    steps: int,
    folder: Path,
    *,
    title: str = 'learning',
    quiet: bool = False,
    alive: Callable[[], bool] = lambda: True,
) -> Outcome:
    """Run `training` to `steps` transitions in `folder`, going on from a checkpoint there.

    Ctrl-C ends the present episode, on a running robot at once, saves and returns; an error is
    raised once all is saved. The folder receives TensorBoard's events, `checkpoint-*` and
    `policy.safetensors`. `alive` is asked after every episode; False stops the run as Ctrl-C does.
    """
    began = time.perf_counter()
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.glob(f'{PREFIX}*')):
        load_checkpoint(folder, training)
    finished = False
    with ExitStack() as stack:
        stack.callback(_save, folder, training, robot)
        show = stack.enter_context(_progress(training, steps, title, quiet))
        curves = stack.enter_context(SummaryWriter(str(folder), purge_step=training.steps + 1))
        signals = stack.enter_context(_stopped_by_signal(training))
        stack.enter_context(suppress(KeyboardInterrupt))  # of an environment that waited

        def log(name: str, value: float, step: int) -> None:
            curves.add_scalar(name, value, step)
            show(name, value, step)

        saved = time.monotonic()

        def between() -> None:
            nonlocal saved
            training.stop = training.stop or not alive()
            if time.monotonic() - saved > SAVE_PERIOD:
                save_checkpoint(folder, training)
                saved = time.monotonic()

        finished = training.run(steps, log, between)
    best, seconds = training.best_return, time.perf_counter() - began
    return Outcome(folder / POLICY, best, training.steps, seconds, finished, bool(signals))


def _save(folder: Path, training: TrainingLoop, robot: Robot) -> None:
    save_checkpoint(folder, training)
    save_policy(folder / POLICY, training, robot)


@contextmanager
def _progress(training: TrainingLoop, steps: int, title: str, quiet: bool) -> Iterator[OnScalar]:
    columns = (
        TextColumn('{task.description}', markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn('steps, left'),
        TimeRemainingColumn(),
        TextColumn('{task.fields[test]}'),
    )
    with Progress(*columns, console=Terminal(stderr=True), disable=quiet) as progress:
        task = progress.add_task(title, total=steps, completed=training.steps, test='')

        def show(name: str, value: float, step: int) -> None:
            if name == 'charts/test_return':
                progress.update(task, test=f'test return {value:.0f}')
            progress.update(task, completed=min(step, steps))

        yield show


@contextmanager
def _stopped_by_signal(training: TrainingLoop) -> Iterator[list[int]]:
    """While inside, SIGINT and SIGTERM end the run after the present episode; those that came.

    A node of this process hears of them too, so that nothing waits for a robot that is gone.
    """
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return

    def stop(number: int, frame: FrameType | None) -> None:
        training.stop = True
        came.append(number)
        signal.signal(number, signal.SIG_DFL)
        handler_before = former[signal.Signals(number)]
        if callable(handler_before) and handler_before is not signal.default_int_handler:
            handler_before(number, frame)

    former = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield came
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
