# SPDX-License-Identifier: Apache-2.0
"""The update of DDPG with gradients derived by hand: what `ddpg.AutogradUpdate` gives, sooner.

Autograd spends several times as long on its own book-keeping as the arithmetic of networks of
this size takes. Here matrix products are numpy's (`layers`), what is between them is compiled
(`elementwise`), and Adam passes once over all parameters (`flat`); torch sees the same memory.
`tests/unit/leo_learner/test_ddpg_update.py` holds it against autograd, option by option.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from threadpoolctl import threadpool_limits

from leo_learner.fast_update.layers import FlatAdam, Layers, parameters_of
from leo_learner.replay import Batch


class Networks(Protocol):
    """What is read of an agent: its settings, and the networks that learn and follow."""

    config: Any
    actor: Any
    critic: Any
    target_actor: Any
    target_critic: Any


class FastUpdate:
    """One gradient step on the critics and the actor of an agent, whose targets follow.

    Numpy and torch share the memory of the agent's parameters and gradients: they may be changed
    in place, not replaced, and the agent not copied. In the process that has one, BLAS works with
    one thread from then on, which is fastest at this size.

    Args:
        agent: whose networks it updates.
    """

    def __init__(self, agent: Networks) -> None:
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
