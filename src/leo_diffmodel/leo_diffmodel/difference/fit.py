# SPDX-License-Identifier: Apache-2.0
"""Fit the difference model to transitions: as the thesis does, or as measured to be better."""

from __future__ import annotations

from collections.abc import Callable
import copy
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import mse_loss

from leo_diffmodel.difference.data import Transitions
from leo_diffmodel.difference.layout import Layout
from leo_diffmodel.difference.network import Config, DifferenceModel, Network

TRAIN = 0.75
"""Share of the transitions, the first in time, that is fitted; the rest is held out."""

OnEpoch = Callable[[int, int, float], None]
"""Receives (epochs done, epochs in all, loss of the last)."""


@dataclass(frozen=True)
class Report:
    """Mean squared one-step error over the state vector, raw units, on the held-out part."""

    mse_before: float
    mse_after: float
    transitions: int
    epochs: int


def fit(
    steps: Transitions,
    layout: Layout,
    robot: str,
    config: Config,
    *,
    start: DifferenceModel | None = None,
    seed: int = 0,
    on_epoch: OnEpoch = lambda done, total, loss: None,
) -> tuple[DifferenceModel, Report]:
    """Learn d(s, a) from the first 75 % of `steps`, in time order, and score it on the rest.

    Args:
        steps: all transitions gathered so far.
        layout: of the robot's state vector.
        robot: name of the robot.
        config: `THESIS`, `RECOMMENDED` or a variation.
        start: the previous difference model, whose weights the fit starts from.
        seed: of the first weights, the batches and the dropout.
        on_epoch: called after every pass over the data.
    """
    torch.set_num_threads(1)
    x, y = tensors(steps, layout)
    cut = round(TRAIN * len(steps))
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        network = _first_network(layout, config, start, x[:cut], y[:cut])
        epochs = _train(network, x[:cut], y[:cut], config, on_epoch)
    network.eval()
    version = start.version + 1 if start else 1
    model = DifferenceModel(network, layout, config, robot, version, len(steps))
    before, after = one_step_mse(steps.part(slice(cut, None)), model)
    return model, Report(before, after, len(steps), epochs)


def tensors(steps: Transitions, layout: Layout) -> tuple[Tensor, Tensor]:
    """Network inputs (N, states + A) and targets (N, states), float32."""
    x = layout.network_input(steps.q, steps.dq, steps.inputs)
    real = layout.state(steps.q_next, steps.dq_next)
    y = real - layout.state(steps.q_model, steps.dq_model)
    return torch.from_numpy(x.astype(np.float32)), torch.from_numpy(y.astype(np.float32))


def one_step_mse(steps: Transitions, model: DifferenceModel) -> tuple[float, float]:
    """Mean squared error over the state vector without and with the difference model."""
    layout = model.layout
    real = layout.state(steps.q_next, steps.dq_next)
    ideal = layout.state(steps.q_model, steps.dq_model)
    corrected = layout.state(
        *model.correct(steps.q, steps.dq, steps.inputs, steps.q_model, steps.dq_model)
    )
    return float(np.mean((real - ideal) ** 2)), float(np.mean((real - corrected) ** 2))


def _first_network(
    layout: Layout, config: Config, start: DifferenceModel | None, x: Tensor, y: Tensor
) -> Network:
    if start is not None and start.config == config:
        return copy.deepcopy(start.network)
    network = Network(layout, config)
    if config.normalise:
        network.normalise(x, y)
    return network


def _train(network: Network, x: Tensor, y: Tensor, config: Config, on_epoch: OnEpoch) -> int:
    """Minimise the mean squared error; returns the epoch whose weights were kept."""
    fitted = round((1 - config.stop_on) * len(x))
    step = _stepper(network, config, fitted)
    best, kept, weights = np.inf, config.epochs, None
    for epoch in range(1, config.epochs + 1):
        network.train()
        order = torch.randperm(fitted)
        loss = [step(x[rows], y[rows]) for rows in order.split(config.batch)][-1]
        if config.stop_on:
            loss = _loss(network, x[fitted:], y[fitted:])
            if loss < best:
                best, kept, weights = loss, epoch, copy.deepcopy(network.state_dict())
        on_epoch(epoch, config.epochs, loss)
    if weights is not None:
        network.load_state_dict(weights)
    return kept


def _stepper(network: Network, config: Config, rows: int) -> Callable[[Tensor, Tensor], float]:
    if config.optimiser == 'adagrad':
        optimiser: torch.optim.Optimizer = torch.optim.Adagrad(network.parameters(), config.rate)
        fall = 1.0
    else:
        optimiser = torch.optim.AdamW(network.parameters(), config.rate, fused=True)
        fall = 0.0
    total = config.epochs * -(-rows // config.batch)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
        optimiser, total, eta_min=config.rate * fall
    )

    def step(x: Tensor, y: Tensor) -> float:
        loss = mse_loss(network(x) / network.target_spread, y / network.target_spread)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        return loss.item()

    return step


def _loss(network: Network, x: Tensor, y: Tensor) -> float:
    network.eval()
    with torch.no_grad():
        return mse_loss(network(x) / network.target_spread, y / network.target_spread).item()
