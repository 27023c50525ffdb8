# SPDX-License-Identifier: Apache-2.0
"""The gradient steps of a fit; the members of an ensemble side by side, each on its batches."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from leo_diffmodel.difference.network import Config, Network, spread_of
from leo_diffmodel.difference.targets import Targets

OnEpoch = Callable[[int, int, float], None]
"""Receives (epochs done, epochs in all, loss of the last)."""


def train(
    network: Network, fitted: Targets, watched: Targets, config: Config, on_epoch: OnEpoch
) -> int:
    """Minimise the mean squared error of the next state; returns the last epoch that was kept.

    Args:
        network: with the weights to start from; receives the best.
        fitted: what the gradients see.
        watched: chooses every member's best epoch; where it is empty the last one is kept.
        config: of the fit.
        on_epoch: called after every pass.
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
        fall = 1.0
    else:
        optimiser = torch.optim.AdamW(network.parameters(), config.rate, fused=True)
        fall = 0.0
    total = config.epochs * -(-len(fitted.x) // config.batch)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
        optimiser, total, eta_min=config.rate * fall
    )

    def step(batch: Targets) -> float:
        loss = _losses(network, batch, scale).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        return loss.item()

    return step


class _Best:
    """The weights of every member's best epoch."""

    def __init__(self, network: Network) -> None:
        self._parameters = list(network.parameters())
        self._kept = [p.detach().clone() for p in self._parameters]
        self._losses: Tensor | None = None
        self._epoch = 0

    def note(self, losses: Tensor, epoch: int) -> None:
        """Keep the weights of the members that were never better."""
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
