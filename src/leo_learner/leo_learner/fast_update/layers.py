# SPDX-License-Identifier: Apache-2.0
"""The networks of `ddpg`, forward and backward in numpy, with gradients derived by hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import torch
from torch import nn, Tensor

import leo_learner.fast_update.elementwise as elementwise

LARGE = 2**21
"""Multiplications from which on torch's matrix product is sooner than numpy's."""
NAMES = 'step', 'exp_avg', 'exp_avg_sq'
"""What torch.optim.Adam keeps of every parameter."""


def product(a: np.ndarray, b: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """The matrix product of a (B, n) and b (n, m), in `out` where it is given."""
    if a.size * b.shape[1] < LARGE:
        return cast(np.ndarray, np.dot(a, b, out))
    into = None if out is None else torch.from_numpy(out)
    return torch.mm(torch.from_numpy(a), torch.from_numpy(b), out=into).numpy()


class _Linear:
    """Weight and bias (gain and shift), and where their gradients go."""

    def __init__(self, module: nn.Module) -> None:
        parameters = [cast(nn.Parameter, p) for p in (module.weight, module.bias)]
        self.weight, self.bias = (p.detach().numpy() for p in parameters)
        self.by_weight, self.by_bias = (
            (torch.empty(0) if p.grad is None else p.grad).numpy() for p in parameters
        )

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """The product (B, m); the bias is still to be added."""
        return product(x, self.weight.T)


class _Hidden:
    """A hidden layer, and what its backward pass needs of the forward pass."""

    def __init__(self, part: nn.Sequential) -> None:
        self.linear = _Linear(part[0])
        self.norm = _Linear(part[1]) if isinstance(part[1], nn.LayerNorm) else None
        self.x = self.y = self._z = self._scale = np.empty(0, np.float32)

    def forward(self, x: np.ndarray) -> np.ndarray:
        """Outputs (B, m) of inputs (B, n)."""
        self.x, self.y = x, self.linear(x)
        if self.norm is None:
            elementwise.relu(self.y, self.linear.bias)
            return self.y
        self._z, self.y = self.y, np.empty_like(self.y)
        norm = self.norm
        self._scale = elementwise.norm_relu(
            self._z, self.linear.bias, norm.weight, norm.bias, self.y
        )
        return self.y

    def slope(self, slope: np.ndarray) -> np.ndarray:
        """Gradient by what the bias is added to, from that by the output; those of vectors."""
        through, last = np.empty_like(self.y), self.norm or self.linear
        elementwise.through_relu(slope, self.y, through, last.by_bias)
        if self.norm:
            elementwise.through_norm(
                through,
                self._z,
                self._scale,
                self.norm.weight,
                self.norm.by_weight,
                self.linear.by_bias,
            )
        return through


class Layers:
    """A network of `ddpg` as layers; an action joins the input of the last hidden one.

    Args:
        network: a `ddpg.Actor` or `ddpg.Critic`, whose parameters are used and whose `grad` are
            written.
    """

    def __init__(self, network: Any) -> None:
        self._hidden = [_Hidden(part) for part in network.hidden]
        self._output = _Linear(network.output)

    def forward(self, x: np.ndarray, action: np.ndarray | None = None) -> np.ndarray:
        """The linear output (B, n) for inputs (B, n_in)."""
        for layer in self._hidden:
            if action is not None and layer is self._hidden[-1]:
                x = np.concatenate([x, action], axis=1)
            x = layer.forward(x)
        return self._output(x) + self._output.bias

    def backward(self, slope: np.ndarray) -> None:
        """Write the parameters' gradients, from the loss's by the output (B, n)."""
        product(slope.T, self._hidden[-1].y, self._output.by_weight)
        slope.sum(axis=0, out=self._output.by_bias)
        after = self._output
        for layer in reversed(self._hidden):
            slope = layer.slope(product(slope, after.weight))
            product(slope.T, layer.x, layer.linear.by_weight)
            after = layer.linear

    def slope_of_action(self, slope: np.ndarray, count: int) -> np.ndarray:
        """Gradient by the action (B, n_act), from that by the output.

        The gradients of the last layer's biases are lost with it.
        """
        last = self._hidden[-1]
        slope = last.slope(product(slope, self._output.weight))
        return product(slope, last.linear.weight[:, -count:])


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
