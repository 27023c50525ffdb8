# SPDX-License-Identifier: Apache-2.0
"""Fit the difference model to transitions: as the thesis does, or as measured to be better."""

import copy
from dataclasses import dataclass, replace

import numpy as np
import torch

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.difference.data import LATE, layout_of, Transitions
from leo_diffmodel.difference.model import DifferenceModel
from leo_diffmodel.difference.network import Config, Network
from leo_diffmodel.difference.training import OnEpoch, Targets, targets, train
from leo_diffmodel.difference.trust import calibrated, Trust
from leo_msgs_py.errors import UserError
from leo_sim.model import Model
from leo_sim.model.physics import of_model

TRAIN = 0.75  # share of the transitions, the first in time, that is fitted; others are held out
LEAST = 40  # fewer transitions are none to learn from or to calibrate with


@dataclass(frozen=True)
class Report:
    """What the fit is worth on the held-out part; a single network is not calibrated.

    Calibration is the rms of the held-out error over the predicted one, of the output where it is
    least and most; 1 is right.
    """

    mse_before: float  # mean squared one-step error over the state vector, raw units
    mse_after: float
    transitions: int  # used in all
    epochs: int  # of the weights that were kept
    calibration_least: float | None = None
    calibration_most: float | None = None
    inside: float | None = None  # share of the held-out steps that are within the data


def fit(
    steps: Transitions,
    model: Model,
    config: Config,
    *,
    start: DifferenceModel | None = None,
    base: str = '',
    seed: int = 0,
    on_epoch: OnEpoch = lambda done, total, loss: None,
) -> tuple[DifferenceModel, Report]:
    """Learn the difference from the first 75 % of `steps`, in time order; score it on the rest.

    The last of the training part chooses the epoch and, of an ensemble, calibrates its spread.
    `start` is the previous difference model, `base` the text of the file of a repaired model;
    `seed` is of the first weights, the batches and the dropout. UserError: too few transitions, or
    steps of another length than the robot's.
    """
    if len(steps) < LEAST:
        raise UserError(
            f'{len(steps)} control steps are too few to learn a difference model from; '
            f'record {LEAST} or more'
        )
    _check_period(steps, model)
    torch.set_num_threads(1)
    layout, data = layout_of(model.robot), targets(steps, model, config.form)
    over = of_model(model)
    cut = round(TRAIN * len(steps))
    seen = round((1 - config.stop_on) * cut)
    former = start if start is not None and start.over == over else None
    fitted, watched = data.part(slice(0, seen)), data.part(slice(seen, cut))
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        network = _first_network(Network(layout, config), config, former, data.part(slice(0, cut)))
        epochs = train(network, fitted, watched, config, on_epoch)
    network.eval()
    trust = _trust(network, fitted, watched) if config.members > 1 else None
    version = start.version + 1 if start else 1
    made = network, layout, config, model.robot.name, version, len(steps), trust, base, over
    difference = DifferenceModel(*made)
    return difference, _report(difference, steps, data, cut, model, epochs)


def _check_period(steps: Transitions, model: Model) -> None:
    robot = model.robot
    if abs(steps.period - robot.control_period) > LATE * robot.control_period:
        raise UserError(
            f'the bags have a command every {steps.period * 1e3:.4g} ms, the control period of '
            f'{robot.name} is {robot.control_period * 1e3:.4g} ms, for which a difference model '
            'is; set control_period in its robot.yaml to that of the bags'
        )


def held_out(steps: Transitions) -> Transitions:
    """The steps that no fit to `steps` sees, the last in time."""
    return steps.part(slice(round(TRAIN * len(steps)), None))


def one_step_mse(steps: Transitions, fitted: DifferenceModel, model: Model) -> tuple[float, float]:
    """Mean squared error over the state vector without and with the difference model."""
    layout = fitted.layout
    real = layout.state(steps.q_next, steps.dq_next)
    ideal = layout.state(steps.q_model, steps.dq_model)
    corrected = layout.state(*fitted.predict(steps, model))
    return float(np.mean((real - ideal) ** 2)), float(np.mean((real - corrected) ** 2))


def calibration(difference: DifferenceModel, data: Targets) -> Array:
    """Rms of error over predicted error of every output, (C,), on data of no fit; 1 is right."""
    assert difference.trust is not None
    error, spread = _errors(difference.network, data)
    expected = difference.trust.uncertainty(spread)
    return np.sqrt(np.mean((error / np.maximum(expected, 1e-12)) ** 2, axis=0))


def _first_network(
    fresh: Network, config: Config, start: DifferenceModel | None, data: Targets
) -> Network:
    """The one behind `start`, as in the thesis; with normalised data it begins anew."""
    if config.normalise:
        fresh.normalise(data.x, data.output_size())
    elif start is not None and start.config == config:
        return copy.deepcopy(start.network)
    return fresh


def _trust(network: Network, fitted: Targets, watched: Targets) -> Trust:
    with torch.no_grad():
        corrections = network.members(fitted.x).mean(0).double().numpy()
    bound, usual = np.abs(corrections).max(axis=0), np.sqrt(np.mean(corrections**2, axis=0))
    return calibrated(*_errors(network, watched), bound, usual)


def _errors(network: Network, data: Targets) -> tuple[Array, Array]:
    """Error of the members' mean and spread of the members, both (N, C)."""
    with torch.no_grad():
        each = network.members(data.x)
        error = data.lacking(each.mean(0), network.target_spread)
    return error.double().numpy(), each.double().numpy().std(axis=0, ddof=1)


def _report(
    fitted: DifferenceModel, steps: Transitions, data: Targets, cut: int, model: Model, epochs: int
) -> Report:
    last = held_out(steps)
    report = Report(*one_step_mse(last, fitted, model), len(steps), epochs)
    if fitted.trust is None:
        return report
    found = calibration(fitted, data.part(slice(cut, None)))
    factor = fitted.judge(last.q, last.dq, last.inputs).factor
    return replace(
        report,
        calibration_least=float(found.min()),
        calibration_most=float(found.max()),
        inside=float(np.mean(factor >= 0.5)),
    )
