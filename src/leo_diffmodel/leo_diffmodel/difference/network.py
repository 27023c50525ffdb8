# SPDX-License-Identifier: Apache-2.0
"""The network d(s, a), one or an ensemble of them side by side, and its configurations."""

from dataclasses import dataclass, replace
from itertools import pairwise

import torch
from torch import nn, Tensor

from leo_diffmodel.difference.data import Layout

FORMS = ('state', 'torque', 'full')


@dataclass(frozen=True)
class Config:
    """Network and fit; the defaults are the thesis' (docs/reference/leo.md 11)."""

    hidden: tuple[int, ...] = (400, 400, 400)  # units of the hidden layers
    activation: str = 'relu'  # or `silu`
    dropout: float = 0.3  # share of hidden units left out while fitting
    normalise: bool = False  # inputs and targets to mean 0 and spread 1; the thesis fits raw units
    optimiser: str = 'adagrad'  # or `adamw`
    rate: float = 0.02  # learning rate; with AdamW it falls to zero along half a cosine
    batch: int = 32  # transitions per gradient step
    epochs: int = 300  # passes over the training part
    stop_on: float = 0.0
    """Share of the training part, its last, that chooses the best epoch; 0 keeps the last one."""
    form: str = 'state'  # what is learned, see `training.targets`: `state`, `torque` or `full`
    prior: float = 0.0
    """Weight of a random function each member adds to what it learns; 3 gives it about a
    third of the size of the target amid the data. Far from them nothing learned cancels it, so the
    members disagree there (Osband et al. 2018, randomised prior functions)."""
    members: int = 1  # several are an ensemble, which knows where its data end, by `stop_on`

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise ValueError(f'no form {self.form!r}; give one of {", ".join(FORMS)}')
        if self.members > 1 and not self.stop_on:
            raise ValueError('an ensemble is calibrated on the share stop_on; give one above 0')


THESIS = Config()
RECOMMENDED = replace(
    THESIS,
    hidden=(64, 64),
    activation='silu',
    dropout=0.0,
    normalise=True,
    optimiser='adamw',
    rate=5e-3,
    batch=128,
    stop_on=0.15,
    members=5,
    prior=3.0,
)
TORQUE = replace(RECOMMENDED, form='torque')
FULL = replace(RECOMMENDED, form='full')
CONFIGS = {'thesis': THESIS, 'recommended': RECOMMENDED, 'torque': TORQUE, 'full': FULL}
ACTIVATIONS = {'relu': nn.ReLU, 'silu': nn.SiLU}


class SideBySide(nn.Module):
    """One linear layer of every member: (M or 1, B, a) -> (M, B, b) in one product."""

    def __init__(self, members: int, a: int, b: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(members, a, b).uniform_(-(a**-0.5), a**-0.5))
        self.bias = nn.Parameter(torch.empty(members, 1, b).uniform_(-(a**-0.5), a**-0.5))

    def forward(self, x: Tensor) -> Tensor:
        return x @ self.weight + self.bias


class Network(nn.Module):
    """(..., states + A) -> (..., outputs), raw units; hidden weights U(+-1/sqrt(fan in)).

    Outputs are the state vector's, or torques [N m] at the actuated joints in the torque form.
    """

    def __init__(self, layout: Layout, config: Config) -> None:
        super().__init__()
        n_in = layout.states + layout.actuators
        n_out = layout.actuators if config.form == 'torque' else layout.states
        self.layers = _layers(n_in, n_out, config)
        self.prior = _layers(n_in, n_out, config).requires_grad_(False) if config.prior else None
        self._weight = config.prior
        self.register_buffer('input_mean', torch.zeros(n_in))
        self.register_buffer('input_spread', torch.ones(n_in))
        self.register_buffer('target_spread', torch.ones(n_out))

    def forward(self, x: Tensor) -> Tensor:
        x = (x - self.input_mean) / self.input_spread
        y = self.layers(x)
        if self.prior is not None:
            y = y + self._weight * self.prior(x)
        return y * self.target_spread

    def members(self, x: Tensor) -> Tensor:
        """Outputs of every member, (M, B, outputs), for inputs (B, in) or (M, B, in)."""
        return self(x if x.ndim == 3 else x[None])

    def normalise(self, x: Tensor, size: Tensor) -> None:
        """Take mean and spread of the inputs, and the usual `size` of each output."""
        self.input_mean.copy_(x.mean(0))
        self.input_spread.copy_(spread_of(x))
        self.target_spread.copy_(size)


def spread_of(columns: Tensor) -> Tensor:
    """Standard deviation of every column, 1 where it is constant."""
    found = columns.std(0)
    return torch.where(found > 1e-9, found, torch.ones(()))


def _layers(n_in: int, n_out: int, config: Config) -> nn.Sequential:
    sizes = [n_in, *config.hidden]
    layers: list[nn.Module] = []
    for a, b in pairwise(sizes):
        linear = _linear(config.members, a, b)
        nn.init.uniform_(linear.weight, -(a**-0.5), a**-0.5)
        dropout = [nn.Dropout(config.dropout)] if config.dropout else []
        layers += [linear, ACTIVATIONS[config.activation](), *dropout]
    return nn.Sequential(*layers, _linear(config.members, sizes[-1], n_out))


def _linear(members: int, a: int, b: int) -> nn.Linear | SideBySide:
    return nn.Linear(a, b) if members == 1 else SideBySide(members, a, b)
