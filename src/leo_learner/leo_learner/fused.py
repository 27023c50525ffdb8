# SPDX-License-Identifier: Apache-2.0
"""The update of `ddpg.Agent` with gradients derived by hand: the same numbers, sooner.

Autograd spends as long on its own book-keeping as on networks of this size. Here every network
is a list of layers whose gradients are written where the optimiser finds them, the critic's
gradient of the action skips all it does not need, and the parameters of a network lie end to
end, so that one operation moves a whole target network. Tests hold it against autograd.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import torch
from torch import nn, Tensor
from torch.nn.functional import linear

from leo_learner.ddpg import Actor, Agent, Config, Critic, Critics, denormals_as_zero
from leo_learner.replay import Batch

LARGE = 2_000_000
"""Multiplications from which on oneDNN is asked."""
ONE_DNN = torch.ops.mkldnn._linear_pointwise
"""What torch.compile makes of a linear layer; torch 2.13.0 has no public name for it."""


class FusedAgent(Agent):
    """As `Agent`; only `learn` differs, and only in how it is computed."""

    def __init__(self, n_obs: int, n_act: int, config: Config, seed: int) -> None:
        super().__init__(n_obs, n_act, config, seed)
        modules = self.actor, self.critic, self.target_actor, self.target_critic
        self._flat = [laid_end_to_end(module) for module in modules]
        self._actor, self._target_actor = Layers(self.actor), Layers(self.target_actor)
        self._critics, self._target_critics = (
            [Layers(cast(Critic, member)) for member in critics.members]
            for critics in (self.critic, cast(Critics, self.target_critic))
        )

    @torch.no_grad()
    def learn(self, batch: Batch) -> dict[str, Tensor]:
        """One gradient step on critic and actor, then the targets follow; returns the losses."""
        columns = Batch(*(torch.from_numpy(column) for column in batch))
        seen, following = (
            torch.mul(o, self.observation_scale)
            for o in (columns.observations, columns.next_observations)
        )
        with denormals_as_zero():
            target = self._target(columns, following)
            losses = self._step_critics(seen, columns.actions, target) | self._step_actor(seen)
            actor, critic, target_actor, target_critic = self._flat
            target_actor.lerp_(actor, self.config.tau)
            target_critic.lerp_(critic, self.config.tau)
        return losses

    def _target(self, batch: Batch, following: Tensor) -> Tensor:
        action = torch.tanh_(self._target_actor.forward(following))
        values = [c.forward(following, action)[:, 0] for c in self._target_critics]
        value = values[0] if len(values) == 1 else torch.minimum(*values)
        bootstrap = self.config.gamma * (1 - batch.terminated) * value
        return torch.addcmul(bootstrap, batch.rewards, self.reward_scale)

    def _step_critics(self, seen: Tensor, action: Tensor, target: Tensor) -> dict[str, Tensor]:
        errors, means = [], []
        for critic in self._critics:
            value = critic.forward(seen, action)[:, 0]
            error = value - target
            critic.backward((2.0 / len(error)) * error[:, None])
            errors.append(error.square().mean())
            means.append(value.mean())
        self.critic_adam.step()
        return {
            'losses/qf_loss': torch.stack(errors).sum(),
            'losses/qf_values': torch.stack(means).mean(),
        }

    def _step_actor(self, seen: Tensor) -> dict[str, Tensor]:
        action = torch.tanh_(self._actor.forward(seen))
        value = self._critics[0].forward(seen, action)
        slope = self._critics[0].slope_of_action(torch.full_like(value, -1.0 / len(value)))
        self._actor.backward(slope * (1 - action.square()))
        self.actor_adam.step()
        return {'losses/actor_loss': -value.mean()}


def product(x: Tensor, weight: Tensor, bias: Tensor | None = None) -> Tensor:
    """A linear layer: (B, n) inputs and (m, n) weights to (B, m), by the faster of two libraries.

    On processors that MKL does not give its widest instructions oneDNN takes half the time, but
    longer to begin.
    """
    if weight.shape[0] * weight.shape[1] * x.shape[0] < LARGE:
        return linear(x, weight, bias)
    return cast(Tensor, ONE_DNN(x, weight, bias, 'none', [], ''))


def laid_end_to_end(module: nn.Module) -> Tensor:
    """Move all parameters of a module into one vector, of which they become views."""
    parameters = list(module.parameters())
    flat = torch.cat([p.detach().flatten() for p in parameters])
    parts = flat.split([p.numel() for p in parameters])
    for parameter, part in zip(parameters, parts, strict=True):
        parameter.data = part.view_as(parameter)
    return flat


@dataclass
class _Layer:
    """A hidden layer, and what its backward pass needs of the forward pass."""

    linear: nn.Linear
    norm: nn.LayerNorm | None
    x: Tensor | None = None
    before: Sequence[Tensor] = ()
    y: Tensor | None = None

    def forward(self, x: Tensor) -> Tensor:
        norm = self.norm
        z = product(x, self.linear.weight, self.linear.bias)
        if norm is not None:
            before = z
            z, mean, rstd = torch.native_layer_norm(
                z, list(norm.normalized_shape), norm.weight, norm.bias, norm.eps
            )
            self.before = before, mean, rstd
        self.x, self.y = x, z.relu_()
        return self.y

    def slope(self, slope: Tensor, learn: bool) -> Tensor:
        """Gradient by what enters the ReLU's linear map; keeps the norm's own to `learn`."""
        assert self.y is not None
        slope = torch.ops.aten.threshold_backward(slope, self.y, 0)
        if self.norm is None:
            return slope
        before, mean, rstd = self.before
        through: Tensor
        through, weight, bias = torch.ops.aten.native_layer_norm_backward(
            slope, before, list(self.norm.normalized_shape), mean, rstd, self.norm.weight,
            self.norm.bias, [True, learn, learn],
        )  # fmt: skip
        if learn:
            self.norm.weight.grad, self.norm.bias.grad = weight, bias
        return through


class Layers:
    """A network of `ddpg` as layers; an action joins the input of the last hidden one.

    Args:
        network: whose parameters are used and whose `grad` are written.
    """

    def __init__(self, network: Actor | Critic) -> None:
        self._hidden = [_layer(cast(nn.Sequential, part)) for part in network.hidden]
        self._output = network.output
        self._last: Tensor | None = None
        self._seen = 0

    def forward(self, x: Tensor, action: Tensor | None = None) -> Tensor:
        """The linear output (B, n) for inputs (B, n_in)."""
        for layer in self._hidden[:-1]:
            x = layer.forward(x)
        self._seen = x.shape[1]
        x = x if action is None else torch.cat([x, action], dim=1)
        self._last = self._hidden[-1].forward(x)
        return product(self._last, self._output.weight, self._output.bias)

    def backward(self, slope: Tensor) -> None:
        """Write the parameters' gradients, from the loss's gradient by the output (B, n)."""
        assert self._last is not None
        _learned(self._output, slope, self._last)
        slope = product(slope, self._output.weight.t())
        for layer in reversed(self._hidden):
            assert layer.x is not None
            slope = layer.slope(slope[:, : layer.linear.out_features], learn=True)
            _learned(layer.linear, slope, layer.x)
            if layer is not self._hidden[0]:
                slope = product(slope, layer.linear.weight.t())

    def slope_of_action(self, slope: Tensor) -> Tensor:
        """Gradient by the action (B, n_act), from that by the output; no parameter learns."""
        layer = self._hidden[-1]
        slope = layer.slope(slope @ self._output.weight, learn=False)
        return slope @ layer.linear.weight[:, self._seen :]


def _layer(part: nn.Sequential) -> _Layer:
    norm = part[1] if isinstance(part[1], nn.LayerNorm) else None
    return _Layer(cast(nn.Linear, part[0]), norm)


def _learned(layer: nn.Linear, slope: Tensor, x: Tensor) -> None:
    layer.weight.grad = product(slope.t(), x.t())
    layer.bias.grad = slope.sum(dim=0)
