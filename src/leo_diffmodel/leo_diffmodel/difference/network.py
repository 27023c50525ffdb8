# SPDX-License-Identifier: Apache-2.0
"""The network d(s, a) and the difference model around it, with its file form."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from itertools import pairwise
import json

import numpy as np
from safetensors import SafetensorError
from safetensors.torch import load, save
import torch
from torch import nn, Tensor

from leo_diffmodel.difference.layout import Layout
from leo_msgs_py.errors import UserError


@dataclass(frozen=True)
class Config:
    """Network and fit; the defaults are the thesis' (data sheet section 11)."""

    hidden: tuple[int, ...] = (400, 400, 400)
    """Units of the hidden layers."""
    activation: str = 'relu'
    """`relu` or `silu`."""
    dropout: float = 0.3
    """Share of hidden units left out while fitting."""
    normalise: bool = False
    """Inputs and targets to mean 0 and spread 1; the thesis fits raw units."""
    optimiser: str = 'adagrad'
    """`adagrad` or `adamw`."""
    rate: float = 0.02
    """Learning rate; with AdamW it falls to zero along half a cosine."""
    batch: int = 32
    """Transitions per gradient step."""
    epochs: int = 300
    """Passes over the training part."""
    stop_on: float = 0.0
    """Share of the training part, its last, that chooses the best epoch; 0 keeps the last one."""


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
    stop_on=0.1,
)
CONFIGS = {'thesis': THESIS, 'recommended': RECOMMENDED}
ACTIVATIONS = {'relu': nn.ReLU, 'silu': nn.SiLU}


class Network(nn.Module):
    """(B, states + A) -> (B, states), both in raw units; hidden weights U(+-1/sqrt(fan in))."""

    def __init__(self, layout: Layout, config: Config) -> None:
        super().__init__()
        n_in = layout.states + layout.actuators
        sizes = [n_in, *config.hidden]
        layers: list[nn.Module] = []
        for a, b in pairwise(sizes):
            linear = nn.Linear(a, b)
            nn.init.uniform_(linear.weight, -(a**-0.5), a**-0.5)
            dropout = [nn.Dropout(config.dropout)] if config.dropout else []
            layers += [linear, ACTIVATIONS[config.activation](), *dropout]
        self.layers = nn.Sequential(*layers, nn.Linear(sizes[-1], layout.states))
        self.register_buffer('input_mean', torch.zeros(n_in))
        self.register_buffer('input_spread', torch.ones(n_in))
        self.register_buffer('target_spread', torch.ones(layout.states))

    def forward(self, x: Tensor) -> Tensor:
        """d(s, a) for a batch of network inputs."""
        return self.layers((x - self.input_mean) / self.input_spread) * self.target_spread

    def normalise(self, x: Tensor, y: Tensor) -> None:
        """Take mean and spread from the training part; constant columns keep spread 1."""
        self.input_mean.copy_(x.mean(0))
        for spread, column in ((self.input_spread, x), (self.target_spread, y)):
            found = column.std(0)
            spread.copy_(torch.where(found > 1e-9, found, torch.ones(())))


@dataclass(frozen=True)
class DifferenceModel:
    """A fitted network and what belongs to it.

    Attributes:
        version: counts the updates, from 1.
        trained_on: transitions used.
        robot: name of the robot.
    """

    network: Network
    layout: Layout
    config: Config
    robot: str
    version: int
    trained_on: int

    def __call__(self, q: np.ndarray, dq: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """d(s, a), (..., states), for joint angles and rates (..., J) and inputs (..., A)."""
        x = torch.from_numpy(self.layout.network_input(q, dq, inputs).astype(np.float32))
        with torch.no_grad():
            return self.network(x).double().numpy()

    def correct(
        self,
        q: np.ndarray,
        dq: np.ndarray,
        inputs: np.ndarray,
        q_model: np.ndarray,
        dq_model: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """The model's next state moved by d(s, a); all (..., J), inputs (..., A)."""
        return self.layout.moved(q_model, dq_model, self(q, dq, inputs))

    def to_bytes(self) -> bytes:
        """As safetensors with `version`, `trained_on`, `robot` in the metadata."""
        metadata = {
            'kind': 'difference_model',
            'version': str(self.version),
            'trained_on': str(self.trained_on),
            'robot': self.robot,
            'layout': json.dumps(asdict(self.layout)),
            'config': json.dumps(asdict(self.config)),
        }
        return save(self.network.state_dict(), metadata)


def from_bytes(data: bytes, source: str = 'difference model') -> DifferenceModel:
    """Read what `to_bytes` wrote.

    Raises:
        UserError: the bytes are something else.
    """
    try:
        tensors = load(data)
        head = json.loads(data[8 : 8 + int.from_bytes(data[:8], 'little')])
        metadata = head['__metadata__']
        layout, config = json.loads(metadata['layout']), json.loads(metadata['config'])
        layout = Layout(**layout | {'continuous': tuple(layout['continuous'])})
        config = Config(**config | {'hidden': tuple(config['hidden'])})
        network = Network(layout, config)
        network.load_state_dict(tensors)
    except (SafetensorError, KeyError, TypeError, RuntimeError) as error:
        raise UserError(
            f'{source}: not the weights of a difference model ({error}); '
            'they come from /difference_model/weights'
        ) from error
    return DifferenceModel(
        network.eval(), layout, config, metadata['robot'],
        int(metadata['version']), int(metadata['trained_on']),
    )
