# SPDX-License-Identifier: Apache-2.0
"""Parameters laid end to end, so that one pass moves them all, and Adam on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import nn, Tensor

import leo_learner.fast_update.elementwise as elementwise

NAMES = 'step', 'exp_avg', 'exp_avg_sq'
"""What torch.optim.Adam keeps of every parameter."""


class FlatAdam:
    """In the place of `ddpg.adam`, with its state, since torch's optimisers import slowly.

    Args:
        module: its parameters and gradients become views of one vector each.
        rate: learning rate.
        l2: on weights, not on biases.
    """

    def __init__(self, module: nn.Module, rate: float, l2: float = 0.0) -> None:
        weights, biases = weights_and_biases(module)
        values = parameters_of(module).numpy()
        zeros = [torch.zeros_like(p.data) for p in (*weights, *biases)]
        slope, slopes = laid_end_to_end(zeros)
        for parameter, view in zip((*weights, *biases), slopes, strict=True):
            parameter.grad = view
        steps, first, second = (
            laid_end_to_end(z) for z in ([torch.zeros(()) for _ in zeros], zeros, zeros)
        )
        views = zip(steps[1], first[1], second[1], strict=True)
        self._kept = [dict(zip(NAMES, kept, strict=True)) for kept in views]
        self._steps, self._rate = steps[0].numpy(), rate
        flat = values, slope.numpy(), first[0].numpy(), second[0].numpy()
        count = sum(w.numel() for w in weights)
        parts = (l2, slice(count)), (0.0, slice(count, None))
        self._groups = [(l2, part, [v[part] for v in flat]) for l2, part in parts]

    def step(self, slow: np.ndarray, share: np.float32) -> None:
        """Move the parameters by their gradients, and a target network's by a share after them."""
        self._steps += 1
        for l2, part, (values, slope, first, second) in self._groups:
            elementwise.adam(
                values,
                slope,
                first,
                second,
                slow[part],
                l2,
                self._rate,
                float(self._steps[0]),
                share,
            )

    def state_dict(self) -> dict[str, Any]:
        """As torch.optim.Adam's."""
        return {'state': dict(enumerate(self._kept)), 'param_groups': []}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """The reverse of `state_dict`, or of torch's; that has none before its first step."""
        for number, kept in enumerate(self._kept):
            for name, tensor in kept.items():
                tensor.copy_(state['state'][number][name]) if state['state'] else tensor.zero_()


def weights_and_biases(module: nn.Module) -> tuple[list[nn.Parameter], list[nn.Parameter]]:
    """The parameters of a module; a layer norm's gains are weights, its shifts biases."""
    named = list(module.named_parameters())
    weights = [p for name, p in named if name.endswith('weight')]
    return weights, [p for name, p in named if not name.endswith('weight')]


def parameters_of(module: nn.Module) -> Tensor:
    """All parameters of a module, which become views of this one vector; weights come first."""
    weights, biases = weights_and_biases(module)
    flat, views = laid_end_to_end([p.detach() for p in (*weights, *biases)])
    for parameter, view in zip((*weights, *biases), views, strict=True):
        parameter.data = view
    return flat


def laid_end_to_end(tensors: Sequence[Tensor]) -> tuple[Tensor, list[Tensor]]:
    """Copies of tensors in one vector, and as views of it."""
    flat = torch.cat([t.flatten() for t in tensors])
    parts = flat.split([t.numel() for t in tensors])
    return flat, [part.view_as(t) for part, t in zip(parts, tensors, strict=True)]
