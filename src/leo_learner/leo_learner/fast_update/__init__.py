# SPDX-License-Identifier: Apache-2.0
"""The update of `ddpg.Agent` with gradients derived by hand: the same numbers, sooner.

Autograd spends several times as long on its own book-keeping as the arithmetic of networks of
this size takes. Here matrix products are numpy's and what is between them is compiled; torch sees
the same memory. Tests hold it against autograd.
"""

from __future__ import annotations

from typing import cast

import numpy as np
from threadpoolctl import threadpool_limits
import torch
from torch import Tensor

from leo_learner.ddpg import Actor, Agent, Config, Critic, Critics, denormals_as_zero
from leo_learner.flat import FlatAdam, parameters_of
from leo_learner.layers import Layers
from leo_learner.replay import Batch


class FusedAgent(Agent):
    """As `Agent`; `act` and `learn` differ, and only in how they are computed.

    Numpy and torch share the memory of its parameters and gradients: they may be changed in place,
    not replaced, and the agent not copied. In the process that has one, BLAS works with one thread
    from then on, which is fastest at this size.
    """

    optimiser = FlatAdam

    def __init__(self, n_obs: int, n_act: int, config: Config, seed: int) -> None:
        super().__init__(n_obs, n_act, config, seed)
        threadpool_limits(1, user_api='blas')
        followers = cast(Critics, self.target_critic)
        self._share = np.float32(config.tau)
        self._slow_actor = parameters_of(self.target_actor).numpy()
        self._slow_critics = parameters_of(followers).numpy()
        self._actor = Layers(self.actor)
        self._target_actor = Layers(cast(Actor, self.target_actor))
        self._critics, self._target_critics = (
            [Layers(cast(Critic, member)) for member in critics.members]
            for critics in (self.critic, followers)
        )

    def act(self, observation: np.ndarray) -> np.ndarray:
        """The policy's action in [-1, 1] for one unscaled observation (n_obs,)."""
        seen = observation.astype(np.float32) * self.observation_scale.numpy()
        return cast(np.ndarray, np.tanh(self._actor.forward(seen[None]))[0])

    def learn(self, batch: Batch) -> dict[str, Tensor]:
        """One gradient step on critic and actor, whose targets follow; returns the losses."""
        scale = self.observation_scale.numpy()
        seen, following = batch.observations * scale, batch.next_observations * scale
        with denormals_as_zero():
            target = self._target(batch, following)
            losses = self._step_critics(seen, batch.actions, target) | self._step_actor(seen)
        return {name: torch.tensor(loss) for name, loss in losses.items()}

    def _target(self, batch: Batch, following: np.ndarray) -> np.ndarray:
        action = np.tanh(self._target_actor.forward(following))
        values = [c.forward(following, action) for c in self._target_critics]
        discount = np.float32(self.config.gamma) * (1 - batch.terminated)
        least = np.minimum.reduce(values)[:, 0]
        return cast(np.ndarray, batch.rewards * self.reward_scale.numpy() + discount * least)

    def _step_critics(
        self, seen: np.ndarray, action: np.ndarray, target: np.ndarray
    ) -> dict[str, float]:
        loss, values = 0.0, []
        for critic in self._critics:
            value = critic.forward(seen, action)
            error = value - target[:, None]
            critic.backward(np.float32(2 / len(error)) * error)
            loss += float(np.vdot(error, error)) / len(error)
            values.append(float(value.sum()) / len(value))
        self.critic_adam.step(self._slow_critics, self._share)
        return {'losses/qf_loss': loss, 'losses/qf_values': sum(values) / len(values)}

    def _step_actor(self, seen: np.ndarray) -> dict[str, float]:
        action = np.tanh(self._actor.forward(seen))
        value = self._critics[0].forward(seen, action)
        slope = np.full_like(value, -1 / len(value))
        slope = self._critics[0].slope_of_action(slope, action.shape[1])
        self._actor.backward(slope * (1 - action * action))
        self.actor_adam.step(self._slow_actor, self._share)
        return {'losses/actor_loss': -float(value.sum()) / len(value)}
