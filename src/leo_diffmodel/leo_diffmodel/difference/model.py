# SPDX-License-Identifier: Apache-2.0
"""A fitted difference model: what it adds to a model's step, how sure it is, and its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
import hashlib
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from safetensors import SafetensorError
from safetensors.torch import load, save
import torch
from torch import Tensor

from leo_diffmodel.difference.data import Layout, layout_of, Transitions
from leo_diffmodel.difference.network import Config, Network
from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.description.robot import Robot
from leo_sim.model import Model, State
from leo_sim.model.batch import rollout
from leo_sim.model.model_file import load_model
from leo_sim.model.physics import differing, of_model, of_robot

TRUST = 'trust.'
WITHIN = 0.99
"""Share of the held-out data that counts as within the data; the rest is their edge."""
SMALL = 0.1
"""Expected errors below this share of the usual correction do no harm, wherever they are."""
TINY = 1e-12
DAMAGE = SafetensorError, KeyError, TypeError, ValueError, RuntimeError, OverflowError
"""What reading damaged weights raises."""


class Judged(NamedTuple):
    """A correction and how far it is to be believed; C outputs.

    Attributes:
        correction: what is applied, (..., C).
        factor: share of it that is left, 1 within the data, (...); 1 of a single network.
        channel: the output that is furthest from its data, (...); None of a single network.
    """

    correction: np.ndarray
    factor: np.ndarray
    channel: np.ndarray | None


@dataclass(frozen=True)
class DifferenceModel:
    """A fitted network, or an ensemble of them, and what belongs to it.

    Attributes:
        version: counts the updates, from 1.
        trained_on: transitions used.
        robot: name of the robot.
        trust: where its data end; None of a single network, which cannot know.
        base: text of the model file it goes on top of, effects named on the way; empty where
            that is the model it was asked for.
        over: `of_model` of the model it goes on top of; empty in files of earlier versions.
        source: file or topic it was read from.
    """

    network: Network
    layout: Layout
    config: Config
    robot: str
    version: int
    trained_on: int
    trust: Trust | None = None
    base: str = ''
    over: Mapping[str, Any] = field(default_factory=dict)
    source: str = 'the difference model'

    def __call__(self, q: np.ndarray, dq: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """The correction, (..., C), for angles and rates (..., J) and inputs (..., A)."""
        return self.judge(q, dq, inputs).correction

    def judge(self, q: np.ndarray, dq: np.ndarray, inputs: np.ndarray) -> Judged:
        """The correction and how far it is to be believed.

        Angles and rates as measured, (..., J); held inputs [V, N m or rad], (..., A). What is
        not finite, or too large for the network, is outside the data and not corrected.
        """
        each = self.members(q, dq, inputs)
        known = np.isfinite(each).all(axis=(0, -1))
        each = np.where(known[..., None], each, 0.0)
        mean = each.mean(axis=0)
        if self.trust is None:
            return Judged(mean, known.astype(float), None)
        strain = self.trust.strain(each.std(axis=0, ddof=1))
        factor = known * self.trust.factor(strain)
        correction = np.clip(mean, -self.trust.bound, self.trust.bound)
        if self.config.form != 'full':  # which has no model to fall back on
            correction = factor[..., None] * correction
        return Judged(correction, factor, (strain / self.trust.limit).argmax(axis=-1))

    def members(self, q: np.ndarray, dq: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """What each member says, (M, ..., C)."""
        with np.errstate(over='ignore', invalid='ignore'):
            x = self.layout.network_input(q, dq, inputs).astype(np.float32)
        with torch.inference_mode():
            each = self.network.members(torch.from_numpy(x.reshape(-1, x.shape[-1])))
        return each.double().numpy().reshape(len(each), *x.shape[:-1], -1)

    def applied(
        self, model: Model, before: State, inputs: np.ndarray, correction: np.ndarray
    ) -> State:
        """The state one control period after `before`, with a correction (C,) of `judge`.

        Inputs are held [V, N m or rad], (A,).
        """
        dt = model.robot.control_period
        if self.config.form == 'torque':
            push = np.zeros(len(before.q))
            push[list(model.robot.actuated)] = correction
            return model.step(before, inputs, dt, push=push)
        after = before if self.config.form == 'full' else model.step(before, inputs, dt)
        q, dq = self.layout.moved(after.q, after.dq, correction)
        if model.laws.stops is not None:
            q = np.clip(q, *model.laws.stops)
        return replace(after, q=q, dq=dq)

    def predict(self, steps: Transitions, model: Model) -> tuple[np.ndarray, np.ndarray]:
        """Angles and rates (N, J) after each of `steps` on `model` with the correction."""
        correction = self(steps.q, steps.dq, steps.inputs)
        if self.config.form == 'torque':
            push = np.zeros_like(steps.q)
            push[:, list(model.robot.actuated)] = correction
            start, inputs = (steps.q, steps.dq), steps.inputs[:, None]
            q, dq = rollout(model, *start, inputs, steps.period, push=push[:, None])
            return q[:, 1], dq[:, 1]
        full = self.config.form == 'full'
        q, dq = (steps.q, steps.dq) if full else (steps.q_model, steps.dq_model)
        return self.layout.moved(q, dq, correction)

    def model_beside(self, path: Path, given: Model) -> Model:
        """The model it goes on top of: `given`, or the repaired one, which is written to `path`.

        Raises:
            UserError: it is of another robot or was fitted over another model; the repaired model
                is none for this program, or cannot be written.
        """
        self.check(given.robot)
        beneath = self._written(path) if self.base else given
        if said := differing(self.over, of_model(beneath)):
            raise UserError(
                f'{self.source} was fitted over a model with {said}; fit it anew over this one '
                '(/difference_model/update), or leave it out'
            )
        return beneath

    def beneath(self, given: Model) -> Model:
        """As `model_beside`, without a file that stays."""
        with TemporaryDirectory() as folder:
            return self.model_beside(Path(folder, 'model.yaml'), given)

    def check(self, robot: Robot) -> None:
        """Raise UserError unless it is of `robot`, as far as it says of which it is."""
        kept, now = {'robot': self.robot} | dict(self.over), of_robot(robot)
        said = differing({name: kept[name] for name in now if name in kept}, now)
        if not said and self.layout != layout_of(robot):
            said = f'a {robot.name} with other joints or actuators'
        if said:
            raise UserError(f'{self.source} is of {said}; fit it anew for this robot')

    @property
    def doubt(self) -> str:
        """What cannot be checked, of a file of an earlier version; '' of all others."""
        if self.over or self.base:
            return ''
        return (
            f'{self.source} does not say over which model it was fitted, as it is of an earlier '
            'version; fit it anew to be sure'
        )

    @property
    def digest(self) -> str:
        """Hash of what it says."""
        return hashlib.sha256(save(self._tensors())).hexdigest()[:12]

    def _written(self, path: Path) -> Model:
        try:
            write_whole(path, self.base)
        except OSError as error:
            raise UserError(f'cannot write {path}: {error.strerror}') from error
        return load_model(path)

    def _tensors(self) -> dict[str, Tensor]:
        trust = {} if self.trust is None else self.trust.arrays()
        found = {TRUST + name: torch.from_numpy(array) for name, array in trust.items()}
        return dict(self.network.state_dict()) | found

    def to_bytes(self) -> bytes:
        """As safetensors; `version`, `trained_on`, `robot`, `form`, `over` in the metadata."""
        metadata = {
            'kind': 'difference_model',
            'version': str(self.version),
            'trained_on': str(self.trained_on),
            'robot': self.robot,
            'form': self.config.form,
            'base': self.base,
            'over': json.dumps(self.over),
            'layout': json.dumps(asdict(self.layout)),
            'config': json.dumps(asdict(self.config)),
        }
        return save(self._tensors(), metadata)


def from_bytes(data: bytes, source: str = 'difference model') -> DifferenceModel:
    """Read what `to_bytes` wrote, in this version or an earlier one.

    Raises:
        UserError: the bytes are something else.
    """
    try:
        tensors = load(data)
        head = json.loads(data[8 : 8 + int.from_bytes(data[:8], 'little')])
        metadata = head['__metadata__']
        _check_finite(tensors)
        layout, config = json.loads(metadata['layout']), json.loads(metadata['config'])
        layout = Layout(**layout | {'continuous': tuple(layout['continuous'])})
        config = Config(**config | {'hidden': tuple(config['hidden'])})
        network = Network(layout, config)
        trust = _trust(tensors, len(network.target_spread)) if config.members > 1 else None
        network.load_state_dict(tensors)
        version, trained_on = int(metadata['version']), int(metadata['trained_on'])
        known = metadata['robot'], version, trained_on, trust, metadata.get('base', '')
        over = dict(json.loads(metadata.get('over', '{}')))
    except DAMAGE as error:
        raise UserError(
            f'{source}: not the weights of a difference model ({one_line(error)}); '
            'they come from /difference_model/weights'
        ) from error
    return DifferenceModel(network.eval(), layout, config, *known, over, source)


def _check_finite(tensors: Mapping[str, Tensor]) -> None:
    for name, tensor in tensors.items():
        if not torch.isfinite(tensor).all():
            raise ValueError(f'{name} has numbers that are none')


def _trust(tensors: dict[str, Tensor], outputs: int) -> Trust:
    """Take the ensemble's trust out of the tensors of a file."""
    names = [name for name in tensors if name.startswith(TRUST)]
    trust = Trust(**{name.removeprefix(TRUST): tensors.pop(name).numpy() for name in names})
    for name, array in trust.arrays().items():
        if array.shape not in ((outputs,), ()) or (array < 0.0).any():
            raise ValueError(f'{TRUST}{name} is not of {outputs} numbers, 0 or more')
    if not (np.all(trust.error > 0.0) and np.all(trust.limit > 0.0)):
        raise ValueError(f'{TRUST}error or {TRUST}limit is 0')
    return trust


@dataclass(frozen=True)
class Trust:
    """What the held-out data say of an ensemble with C outputs, raw units.

    Attributes:
        temperature: held-out error over spread of the members, rms, (C,).
        error: held-out error, rms, (C,).
        limit: strain up to which a correction is applied in full, (C,) (one number in files of
            earlier versions).
        bound: largest correction on the data, either sign, (C,).
    """

    temperature: np.ndarray
    error: np.ndarray
    limit: np.ndarray
    bound: np.ndarray

    def uncertainty(self, spread: np.ndarray) -> np.ndarray:
        """Standard deviation to expect of the error, (..., C), from the members' spread."""
        return self.temperature * spread

    def strain(self, spread: np.ndarray) -> np.ndarray:
        """Expected error over the one seen on held-out data, (..., C)."""
        return self.uncertainty(spread) / self.error

    def factor(self, strain: np.ndarray) -> np.ndarray:
        """Share of the correction to apply, (...): 1 within the data, 0 far from them.

        It is 1 up to `limit`, which 99 % of the held-out data stay below (or where the expected
        error is small against the correction), 0 from twice the limit on, and a cubic between
        them. The worst output decides.
        """
        beyond = np.clip((strain / self.limit).max(axis=-1) - 1.0, 0.0, 1.0)
        return 1.0 - beyond**2 * (3.0 - 2.0 * beyond)

    def arrays(self) -> dict[str, np.ndarray]:
        """By name."""
        return {f.name: np.asarray(getattr(self, f.name), float) for f in fields(self)}


def calibrated(
    error: np.ndarray, spread: np.ndarray, bound: np.ndarray, usual: np.ndarray
) -> Trust:
    """The trust that held-out data give.

    Args:
        error: of the members' mean, (N, C).
        spread: standard deviation over the members, (N, C).
        bound: largest correction on the data, (C,).
        usual: rms of the corrections there, (C,).
    """
    spread = np.maximum(spread, TINY)
    rms = np.maximum(np.sqrt(np.mean(error**2, axis=0)), TINY)
    temperature = np.maximum(np.sqrt(np.mean((error / spread) ** 2, axis=0)), TINY)
    strain = (temperature * spread / rms).max(axis=-1)
    limit = np.maximum(np.quantile(strain, WITHIN), SMALL * usual / rms)
    return Trust(temperature, rms, limit, bound)
