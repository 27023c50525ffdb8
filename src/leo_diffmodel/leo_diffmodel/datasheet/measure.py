# SPDX-License-Identifier: Apache-2.0
"""From recordings of a motor to all that its data sheet says, by fits and predictions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.sizes import inertia_scale
from leo_diffmodel.datasheet import settings
from leo_diffmodel.datasheet.ladder import added, better, climb, Ladder
from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.estimate.covariance import covariance
from leo_diffmodel.explain.estimate.estimator import Estimate, Progress
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit
from leo_diffmodel.explain.estimate.smooth import Smooth
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.candidates import limited, seen, uncertain
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import pose, Posed, untestable
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.problem.usable import Cut, Logged
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.settings import settings_for
from leo_msgs_py.console import Reporter
from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_sim.description.robot import Constant, Robot
from leo_sim.effects import Effect
from leo_sim.model import Model

RECORD = 'record the motion that leo datasheet --motion writes'


@dataclass(frozen=True)
class Measured:
    model: Model  # whose constants of the motor were open
    joint: str
    posed: Posed
    ladder: Ladder
    final: Fit  # the chosen law, fitted once more with finer integration steps
    alone: tuple[tuple[Scored, bool], ...]
    """The chosen law with each effect that a scan finds worth a fit, and whether that surely
    predicts better."""
    held: HeldOut  # windows that no fit was made on
    notes: tuple[str, ...]  # what is wrong with the log, and what of it was left out


def measure(
    recordings: Recordings,
    model: Model,
    joint: str,
    extra: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Measured:
    """Fit the constants of the motor at a joint, its friction, and what else it does.

    The motor's constants are open, whatever the model says of them; arm and load are known.
    """
    model = opened(with_known(model, recordings), joint)
    data, notes = _usable(recordings, model)
    posed, reporter = _posed(data, model), Reporter.of(progress)
    fits = Smooth(posed, scales_of(model, posed.problem.windows))
    able = (c for c in seen(model, data, extra) if is_of_motor(c, joint, model.robot))
    pool = [limited(c, model, posed.problem.grids) for c in able]
    rich = _rich(fits, pool, reporter)
    friction = {c.effect.name: c for c in pool if c.effect.name in settings.FRICTION}
    after, own = posed.problem.numerics.starting, any(e.source for e in extra)
    with trials.by_processes(climb, after, not own):
        ladder = climb(fits, rich, friction, reporter)
        _, best = ladder.chosen
        rest = [c for c in pool if c.effect.name not in settings.FRICTION and c not in best.names]
        alone = ladder.alone(fits, rest, reporter)
    held = HeldOut.of(data, posed, best.fit, model)
    final = last_fit(posed.problem, best.fit)
    reporter('the last fit')
    return Measured(model, joint, posed, ladder, final, tuple(alone), held, tuple(notes))


def opened(model: Model, joint: str) -> Model:
    """The model with the constants of the motor at a joint uncertain; UserError without one."""
    robot, names = model.robot, [a.joint for a in model.robot.actuators]
    if robot.contacts:
        raise UserError(f'{robot.name} touches the ground; a data sheet is of a motor on a bench')
    if joint not in names:
        hint = nearest(joint, names)
        raise UserError(
            f'{robot.name} has no motor at {joint!r}{hint}; motors: {", ".join(names)}'
        )
    paths = (f'actuators.{joint}.{figure}' for figure in settings.FIGURES)
    known = [robot.constants[path] for path in paths if path in robot.constants]
    changed = {c.path: _open(c, robot) for c in known if c.uncertain is None}
    return model.changed(robot=robot.with_constants(changed))


def _open(constant: Constant, robot: Robot) -> Constant:
    low, high = constant.value / settings.TIMES, constant.value * settings.TIMES
    if constant.path.endswith('rotor_inertia'):  # 0 in a file that does not say
        low, high = 0.0, max(high, inertia_scale(robot))
    return replace(constant, uncertain=(low, high))


def is_of_motor(candidate: Candidate, joint: str, robot: Robot) -> bool:
    effect = candidate.effect
    same = settings.THE_SAME if robot.has_motor_law else settings.THE_SAME[-1:]
    here = candidate.where == joint or (candidate.where == 'all' and effect.late)
    return here and effect.hook not in ('body', 'ground') and effect.name not in same


def _usable(recordings: Recordings, model: Model) -> tuple[list[Recording], list[str]]:
    log = Logged.of(recordings, (), model, mend=False, by_torques=True)
    if log.in_the_way:
        said, todo = log.answer
        raise UserError(f'{said} {todo}')
    cut = Cut.of(log.recordings, (), settings_for(model.robot), model)
    return cut.thinned[0], [*(f.what for f in log.faults), *cut.notes]


def _posed(data: Recordings, model: Model) -> Posed:
    try:
        posed = pose(data, (), model)
    except ValueError as error:
        raise UserError(f'{error}; {RECORD}') from error
    if reason := untestable(posed.problem):
        raise UserError(f'{reason}; {RECORD}')
    return posed


def _rich(fits: Smooth, pool: Sequence[Candidate], reporter: Progress) -> Estimate:
    problem, named = fits.posed.problem, {c.effect.name: c for c in pool}
    at = fits.first(Hypothesis(constants=uncertain(problem.base, problem.trained)))
    for name in settings.COMMON:
        at = added(fits, at, named[name], reporter) if name in named else at
    at = fits.finished(at, [at.fit.hypothesis.neutral], reporter)
    reporter('friction of any kind')
    rest = [c for c in pool if c.effect.name not in settings.FRICTION]
    while wider := better(fits, at, rest, reporter):
        at = wider
        rest = [c for c in rest if c not in at.names]
    return at


def last_fit(problem: Problem, fitted: Fit) -> Fit:
    """A fit made again with finer and finer steps, and what the last one leaves taken off.

    A step of 1.25 ms moved a rotor inertia by eight errors. A quarter of it leaves a quarter of
    that, a third of what the change moved a value (Richardson 1911), which goes into its error.
    """
    for power in range(1, settings.MOST_FINER + 1):
        before, fitted = fitted, _stepped(problem, fitted, settings.FINER**power)
        left = (fitted.theta - before.theta) * settings.FINER / (1.0 - settings.FINER)
        if (np.abs(left) <= settings.STEP_ERROR * fitted.standard_errors).all():
            break
    theta = fitted.hypothesis.bounded(fitted.theta + left)
    return replace(fitted, theta=theta, covariance=_wider(problem, fitted) + np.outer(left, left))


def _wider(problem: Problem, fitted: Fit) -> np.ndarray:
    """Covariance with the larger of the variances that blocks and residual give, (P, P)."""
    train, channels = problem.train, fitted.start.shape[-1]
    residual = fitted.residual[train]
    block = np.arange(len(residual)) if problem.block is None else problem.block[train]
    prior, spread = fitted.hypothesis.prior(fitted.theta), dispersion(fitted.take(train))
    weighed = prior, spread, channels, problem.numerics, fitted.typical
    return covariance(fitted.columns[train], residual, block, *weighed, larger=True)


def _stepped(problem: Problem, fitted: Fit, share: float) -> Fit:
    base = problem.base.changed(integration_step=share * problem.base.integration_step)
    finer = replace(problem, base=base, rough_step=None)
    return fit(finer, fitted.hypothesis, fitted.theta, fitted.start, thorough=True)
