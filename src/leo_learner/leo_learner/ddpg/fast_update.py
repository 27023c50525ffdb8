# SPDX-License-Identifier: Apache-2.0
"""The update of DDPG with gradients derived by hand.

Autograd spends several times as long on its own book-keeping as the arithmetic of networks of
this size takes. Here matrix products are numpy's, what is between them is compiled
(`elementwise`), and Adam passes once over all parameters; torch sees the same memory. Tests hold
it against the laboratory's `autograd_update`, option by option.
"""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from threadpoolctl import threadpool_limits
import torch
from torch import nn, Tensor
from torch.nn.utils import parameters_to_vector, vector_to_parameters

from leo_learner.ddpg import elementwise
from leo_learner.training.replay import Batch

LARGE = 2**21  # multiplications from which on torch's matrix product is sooner than numpy's
NAMES = 'step', 'exp_avg', 'exp_avg_sq'  # what torch.optim.Adam keeps of every parameter


class FastUpdate:
    """One gradient step on the critics and the actor of a `ddpg.Agent`, whose targets follow.

    Numpy and torch share the memory of the agent's parameters and gradients: they may be changed
    in place, not replaced, and the agent not copied. In the process that has one, BLAS works with
    one thread from then on, which is fastest at this size.
    """

    def __init__(self, agent: Any) -> None:
        threadpool_limits(1, user_api='blas')
        config = agent.config
        self._gamma, self._tau = np.float32(config.gamma), np.float32(config.tau)
        self.actor_adam = FlatAdam(agent.actor, config.actor_rate)
        self.critic_adam = FlatAdam(agent.critic, config.critic_rate, config.critic_l2)
        self._slow_actor = parameters_of(agent.target_actor).numpy()
        self._slow_critics = parameters_of(agent.target_critic).numpy()
        self._actor, self._target_actor = Layers(agent.actor), Layers(agent.target_actor)
        self._critics = [Layers(member) for member in agent.critic.members]
        self._target_critics = [Layers(member) for member in agent.target_critic.members]

    def __call__(self, batch: Batch) -> dict[str, float]:
        """Update on a scaled batch; the losses and the mean value, as logged."""
        target = self._target(batch)
        return self._step_critics(batch, target) | self._step_actor(batch.observations)

    def _target(self, batch: Batch) -> np.ndarray:
        following = batch.next_observations
        action = np.tanh(self._target_actor.forward(following))
        values = [c.forward(following, action) for c in self._target_critics]
        least: np.ndarray = np.minimum.reduce(values)[:, 0]
        return batch.rewards + self._gamma * (1 - batch.terminated) * least

    def _step_critics(self, batch: Batch, target: np.ndarray) -> dict[str, float]:
        loss, values = 0.0, []
        for critic in self._critics:
            value = critic.forward(batch.observations, batch.actions)
            error = value - target[:, None]
            critic.backward(np.float32(2 / len(error)) * error)
            loss += float(np.vdot(error, error)) / len(error)
            values.append(float(value.sum()) / len(value))
        self.critic_adam.step(self._slow_critics, self._tau)
        return {'losses/qf_loss': loss, 'losses/qf_values': sum(values) / len(values)}

    def _step_actor(self, observations: np.ndarray) -> dict[str, float]:
        action = np.tanh(self._actor.forward(observations))
        value = self._critics[0].forward(observations, action)
        slope = np.full_like(value, -1 / len(value))
        slope = self._critics[0].slope_of_action(slope, action.shape[1])
        self._actor.backward(slope * (1 - action * action))
        self.actor_adam.step(self._slow_actor, self._tau)
        return {'losses/actor_loss': -float(value.sum()) / len(value)}


def product(a: np.ndarray, b: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    if a.size * b.shape[1] < LARGE:
        return cast(np.ndarray, np.dot(a, b, out))
    into = None if out is None else torch.from_numpy(out)
    return torch.mm(torch.from_numpy(a), torch.from_numpy(b), out=into).numpy()


class _Linear:
    """Weight and bias (gain and shift), and where their gradients go; the bias is added later."""

    def __init__(self, module: nn.Module) -> None:
        parameters = [cast(nn.Parameter, p) for p in (module.weight, module.bias)]
        self.weight, self.bias = (p.detach().numpy() for p in parameters)
        grads = (torch.empty(0) if p.grad is None else p.grad for p in parameters)
        self.by_weight, self.by_bias = (grad.numpy() for grad in grads)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return product(x, self.weight.T)


class _Hidden:
    """A hidden layer, and what its backward pass needs of the forward pass."""

    def __init__(self, part: nn.Sequential) -> None:
        self.linear = _Linear(part[0])
        self.norm = _Linear(part[1]) if isinstance(part[1], nn.LayerNorm) else None
        self.x = self.y = self._z = self._scale = np.empty(0, np.float32)

    def forward(self, x: np.ndarray) -> np.ndarray:
        self.x, self.y = x, self.linear(x)
        if self.norm is None:
            elementwise.relu(self.y, self.linear.bias)
            return self.y
        self._z, self.y = self.y, np.empty_like(self.y)
        shifts = self.linear.bias, self.norm.weight, self.norm.bias
        self._scale = elementwise.norm_relu(self._z, *shifts, self.y)
        return self.y

    def slope(self, slope: np.ndarray) -> np.ndarray:
        """Gradient by what the bias is added to, from that by the output; those of vectors."""
        through, last = np.empty_like(self.y), self.norm or self.linear
        elementwise.through_relu(slope, self.y, through, last.by_bias)
        if self.norm:
            slopes = self.norm.by_weight, self.linear.by_bias
            elementwise.through_norm(through, self._z, self._scale, self.norm.weight, *slopes)
        return through


class Layers:
    """An actor or critic of `ddpg`; an action joins the input of the last hidden layer.

    The network's parameters are used and their `grad` are written.
    """

    def __init__(self, network: Any) -> None:
        self._hidden = [_Hidden(part) for part in network.hidden]
        self._output = _Linear(network.output)

    def forward(self, x: np.ndarray, action: np.ndarray | None = None) -> np.ndarray:
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
    """In the place of torch.optim.Adam, with its state; torch's optimisers import slowly.

    Parameters and gradients become views of one vector each. The l2 term spares the biases.
    """

    def __init__(self, module: nn.Module, rate: float, l2: float = 0.0) -> None:
        weights, biases = weights_and_biases(module)
        values, parameters = parameters_of(module), [*weights, *biases]
        slope, first, second = (torch.zeros_like(values) for _ in range(3))
        for parameter, view in zip(parameters, _views(slope, parameters), strict=True):
            parameter.grad = view
        steps = torch.zeros(len(parameters))
        kept = steps.unbind(), _views(first, parameters), _views(second, parameters)
        self._kept = [dict(zip(NAMES, own, strict=True)) for own in zip(*kept, strict=True)]
        self._steps, self._rate = steps.numpy(), rate
        flat = [vector.numpy() for vector in (values, slope, first, second)]
        count = sum(w.numel() for w in weights)
        parts = (l2, slice(count)), (0.0, slice(count, None))
        self._groups = [(l2, part, [v[part] for v in flat]) for l2, part in parts]

    def step(self, slow: np.ndarray, share: np.float32) -> None:
        """Move the parameters by their gradients, and a target network's by a share after them."""
        self._steps += 1
        count = float(self._steps[0])
        for l2, part, (values, slope, first, second) in self._groups:
            rates = l2, self._rate, count, share
            elementwise.adam(values, slope, first, second, slow[part], *rates)

    def state_dict(self) -> dict[str, Any]:
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
    parameters = [*weights, *biases]
    flat = parameters_to_vector(parameters).detach()
    vector_to_parameters(flat, parameters)
    return flat


def _views(flat: Tensor, parameters: Sequence[Tensor]) -> list[Tensor]:
    parts = flat.split([p.numel() for p in parameters])
    return [part.view_as(p) for part, p in zip(parts, parameters, strict=True)]
