# SPDX-License-Identifier: Apache-2.0
"""The update of DDPG in PyTorch, the reference: `FastUpdate` gives the same to rounding."""

from __future__ import annotations

import torch
from torch import nn, Tensor
from torch.nn.functional import mse_loss

from leo_learner.ddpg.agent import Agent
from leo_learner.ddpg.fast_update import weights_and_biases
from leo_learner.training.replay import Batch


def adam(module: nn.Module, rate: float, l2: float = 0.0) -> torch.optim.Adam:
    """Adam whose L2 term spares the biases; 1/2 c |W|^2 in the loss is c W in the gradient."""
    weights, biases = weights_and_biases(module)
    groups = [{'params': weights, 'weight_decay': l2}, {'params': biases}]
    return torch.optim.Adam(groups, lr=rate, fused=True)


class AutogradUpdate:
    """One gradient step on the critics and the actor of an agent, whose targets follow.

    With target networks Q', mu' and a batch of (s, a, r, s', d):

        y = r + gamma (1 - d) min_i Q'_i(s', mu'(s'))
        critics: minimise sum_i mean((Q_i(s, a) - y)^2) + c/2 |W|^2
        actor:   maximise mean(Q_1(s, mu(s)))
        targets: w' <- w' + tau (w - w')

    """

    def __init__(self, agent: Agent) -> None:
        self._agent, config = agent, agent.config
        self.actor_adam = adam(agent.actor, config.actor_rate)
        self.critic_adam = adam(agent.critic, config.critic_rate, config.critic_l2)

    def __call__(self, batch: Batch) -> dict[str, float]:
        """Update on a scaled batch; the losses and the mean value, as logged."""
        tensors = Batch(*(torch.from_numpy(column) for column in batch))
        losses = self._step_critics(tensors) | self._step_actor(tensors.observations)
        self._follow(self._agent.target_actor, self._agent.actor)
        self._follow(self._agent.target_critic, self._agent.critic)
        return losses

    def _step_critics(self, batch: Batch) -> dict[str, float]:
        agent = self._agent
        with torch.no_grad():
            following = batch.next_observations
            value = agent.target_critic(following, agent.target_actor(following)).amin(dim=0)
            target = batch.rewards + agent.config.gamma * (1 - batch.terminated) * value
        values = agent.critic(batch.observations, batch.actions)
        loss = sum(mse_loss(value, target) for value in values)
        self.critic_adam.zero_grad()
        loss.backward()
        self.critic_adam.step()
        return {'losses/qf_loss': loss.item(), 'losses/qf_values': values.mean().item()}

    def _step_actor(self, observations: Tensor) -> dict[str, float]:
        agent = self._agent
        agent.critic.requires_grad_(False)
        loss = -agent.critic.members[0](observations, agent.actor(observations)).mean()
        self.actor_adam.zero_grad()
        loss.backward()
        self.actor_adam.step()
        agent.critic.requires_grad_(True)
        return {'losses/actor_loss': loss.item()}

    def _follow(self, target: nn.Module, learned: nn.Module) -> None:
        with torch.no_grad():
            for slow, fast in zip(target.parameters(), learned.parameters(), strict=True):
                slow.lerp_(fast, self._agent.config.tau)
