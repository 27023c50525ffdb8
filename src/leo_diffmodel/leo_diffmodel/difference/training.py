# SPDX-License-Identifier: Apache-2.0
"""The gradient steps of a fit; the members of an ensemble side by side, each on its batches."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import torch
from torch import Tensor

from leo_diffmodel.compare.sizes import stall_torque
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.difference.data import layout_of, Transitions
from leo_diffmodel.difference.network import Config, Network, spread_of
from leo_sim.model import Model
from leo_sim.model.batch import rollout

OnEpoch = Callable[[int, int, float], None]
"""Receives (epochs done, epochs in all, loss of the last)."""
TORQUE_STEP = 0.03  # of the stall torque, to differentiate the next state by
STEEP = 1.5
"""A step whose next state depends on the torque this many times as much as usual holds an impact
or a slip that the torque moves in time; its weight falls so that it counts no more than that."""
RIDGE = 1e-2  # keeps a torque that hardly moves anything (at a stop) from explaining everything


@dataclass(frozen=True)
class Targets:
    """N transitions as a network sees them, float32.

    `effect` is how the state vector moves per N m of output, weighted like `y`; None where the
    output is the move.
    """

    x: Tensor  # network inputs (N, states + A)
    y: Tensor  # what its output has to add to the state vector, (N, states)
    effect: Tensor | None = None  # (N, states, A)

    def part(self, rows: slice | Tensor) -> Self:
        effect = None if self.effect is None else self.effect[rows]
        return replace(self, x=self.x[rows], y=self.y[rows], effect=effect)

    def moved(self, output: Tensor) -> Tensor:
        """How the state vector moves, (..., N, states), for outputs (..., N, outputs)."""
        return output if self.effect is None else (self.effect @ output[..., None])[..., 0]

    def lacking(self, output: Tensor, size: Tensor) -> Tensor:
        """What outputs (N, outputs) should have been more, (N, outputs).

        `size` is the usual size of an output, (outputs,).
        """
        missing = self.y - self.moved(output)
        if self.effect is None:
            return missing
        spread = spread_of(self.y)
        effect, missing = self.effect * size / spread[:, None], missing / spread
        normal = effect.mT @ effect + RIDGE * torch.eye(len(size))
        return torch.linalg.solve(normal, (effect.mT @ missing[..., None])[..., 0]) * size

    def output_size(self) -> Tensor:
        """Usual size of each output, (outputs,): a torque's is what would explain all of `y`."""
        spread = spread_of(self.y)
        if self.effect is None:
            return spread
        strength = (self.effect / spread[:, None]).square().mean((0, 1)).sqrt()
        return 1.0 / strength.clamp_min(1e-9)


def train(
    network: Network, fitted: Targets, watched: Targets, config: Config, on_epoch: OnEpoch
) -> int:
    """Minimise the mean squared error of the next state; returns the last epoch that was kept.

    The network receives the best weights: `watched`, which no gradient sees, chooses every
    member's best epoch; where it is empty the last one is kept.
    """
    scale = spread_of(fitted.y) if config.normalise else torch.ones(())
    step = _stepper(network, config, fitted, scale)
    best = _Best(network)
    for epoch in range(1, config.epochs + 1):
        network.train()
        order = torch.stack([torch.randperm(len(fitted.x)) for _ in range(config.members)])
        loss = [step(fitted.part(rows)) for rows in order.split(config.batch, dim=1)][-1]
        if len(watched.x):
            network.eval()
            with torch.no_grad():
                losses = _losses(network, watched, scale)
            best.note(losses, epoch)
            loss = float(losses.mean())
        on_epoch(epoch, config.epochs, loss)
    return best.restore() if len(watched.x) else config.epochs


def _losses(network: Network, data: Targets, scale: Tensor) -> Tensor:
    """Mean squared error of every member, (M,)."""
    error = (data.moved(network.members(data.x)) - data.y) / scale
    return error.square().mean((1, 2))


def _stepper(
    network: Network, config: Config, fitted: Targets, scale: Tensor
) -> Callable[[Targets], float]:
    if config.optimiser == 'adagrad':
        optimiser: torch.optim.Optimizer = torch.optim.Adagrad(network.parameters(), config.rate)
        least = config.rate
    else:
        optimiser = torch.optim.AdamW(network.parameters(), config.rate, fused=True)
        least = 0.0
    total = config.epochs * -(-len(fitted.x) // config.batch)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, total, eta_min=least)

    def step(batch: Targets) -> float:
        loss = _losses(network, batch, scale).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        return loss.item()

    return step


class _Best:
    def __init__(self, network: Network) -> None:
        self._parameters = list(network.parameters())
        self._kept = [p.detach().clone() for p in self._parameters]
        self._losses: Tensor | None = None
        self._epoch = 0

    def note(self, losses: Tensor, epoch: int) -> None:
        before = torch.full_like(losses, torch.inf) if self._losses is None else self._losses
        better = losses < before
        self._losses = torch.minimum(before, losses)
        if not better.any():
            return
        self._epoch = epoch
        rows = slice(None) if better.all() else better
        for kept, parameter in zip(self._kept, self._parameters, strict=True):
            kept[rows] = parameter.detach()[rows]

    def restore(self) -> int:
        """Put the best weights back; returns the last epoch one of them is from."""
        with torch.no_grad():
            for kept, parameter in zip(self._kept, self._parameters, strict=True):
                parameter.copy_(kept)
        return self._epoch


def targets(steps: Transitions, model: Model, form: str) -> Targets:
    layout = layout_of(model.robot)
    x = layout.network_input(steps.q, steps.dq, steps.inputs)
    base = (steps.q, steps.dq) if form == 'full' else (steps.q_model, steps.dq_model)
    y = layout.state(steps.q_next, steps.dq_next) - layout.state(*base)
    if form != 'torque':
        return Targets(_float(x), _float(y))
    effect = torque_effect(steps, model)
    size = np.linalg.norm(effect, axis=(1, 2))
    weight = np.minimum(1.0, STEEP * np.median(size) / np.maximum(size, 1e-12))[:, None]
    return Targets(_float(x), _float(weight * y), _float(weight[..., None] * effect))


def torque_effect(steps: Transitions, model: Model) -> Array:
    """Derivative of the next state vector by torques held over the step, (N, states, A)."""
    robot = model.robot
    if 'training' in robot.schemes:
        model = model.changed(scheme='training')
    size = np.array([TORQUE_STEP * (stall_torque(robot, a.joint) or 1.0) for a in robot.actuators])
    push = np.zeros((1 + len(size), len(steps), 1, len(robot.joint_names)))
    push[np.arange(len(size)) + 1, :, :, robot.actuated] = size[:, None, None]
    q, dq = rollout(model, steps.q, steps.dq, steps.inputs[:, None], steps.period, push=push)
    state = layout_of(robot).state(q[..., 1, :], dq[..., 1, :])
    return np.moveaxis((state[1:] - state[0]) / size[:, None, None], 0, -1)


def _float(array: Array) -> Tensor:
    return torch.from_numpy(array.astype(np.float32))
