# SPDX-License-Identifier: Apache-2.0
"""A fitted difference model: what it adds to a model's step, how sure it is, and its file."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
import hashlib
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from safetensors.torch import save
import torch
from torch import Tensor

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.difference.data import Layout, layout_of, Transitions
from leo_diffmodel.difference.network import Config, Network
from leo_diffmodel.difference.tensors import DAMAGE, read_tensors
from leo_diffmodel.difference.trust import Trust
from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.description.robot import Robot
from leo_sim.model import Model, State
from leo_sim.model.batch import rollout
from leo_sim.model.model_file import load_model
from leo_sim.model.physics import differing, of_model, of_robot

TRUST = 'trust.'


class Judged(NamedTuple):
    """A correction and how far it is to be believed; C outputs."""

    correction: Array  # what is applied, (..., C)
    factor: Array  # share of it that is left, 1 within the data, (...); 1 of a single network
    channel: Array | None  # output furthest from its data, (...); None of a single network


@dataclass(frozen=True)
class DifferenceModel:
    """A fitted network, or an ensemble of them, and what belongs to it."""

    network: Network
    layout: Layout
    config: Config
    robot: str  # its name
    version: int  # counts the updates, from 1
    trained_on: int  # transitions
    trust: Trust | None = None  # where its data end; a single network cannot know
    base: str = ''
    """Text of the model file it goes on top of, with effects named on the way; empty where that is
    the model it was asked for."""
    over: Mapping[str, Any] = field(default_factory=dict)  # `of_model` of what it goes on top of
    source: str = 'the difference model'  # file or topic it was read from

    def __call__(self, q: Array, dq: Array, inputs: Array) -> Array:
        """The correction, (..., C), for angles and rates (..., J) and inputs (..., A)."""
        return self.judge(q, dq, inputs).correction

    def judge(self, q: Array, dq: Array, inputs: Array) -> Judged:
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

    def members(self, q: Array, dq: Array, inputs: Array) -> Array:
        """What each member says, (M, ..., C)."""
        with np.errstate(over='ignore', invalid='ignore'):
            x = self.layout.network_input(q, dq, inputs).astype(np.float32)
        with torch.inference_mode():
            each = self.network.members(torch.from_numpy(x.reshape(-1, x.shape[-1])))
        return each.double().numpy().reshape(len(each), *x.shape[:-1], -1)

    def applied(self, model: Model, before: State, inputs: Array, correction: Array) -> State:
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

    def predict(self, steps: Transitions, model: Model) -> tuple[Array, Array]:
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

        UserError: it is of another robot or was fitted over another model; the repaired model is
        none for this program, or cannot be written.
        """
        self.check(given.robot)
        beneath = given
        if self.base:
            try:
                write_whole(path, self.base)
            except OSError as error:
                raise UserError(f'cannot write {path}: {error.strerror}') from error
            beneath = load_model(path)
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
    def digest(self) -> str:
        return hashlib.sha256(save(self._tensors())).hexdigest()[:12]

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
    """Read what `to_bytes` wrote; UserError for all else."""
    try:
        tensors, metadata = read_tensors(data)
        layout, config = json.loads(metadata['layout']), json.loads(metadata['config'])
        layout = Layout(**layout | {'continuous': tuple(layout['continuous'])})
        config = Config(**config | {'hidden': tuple(config['hidden'])})
        network = Network(layout, config)
        trust = _trust(tensors, len(network.target_spread)) if config.members > 1 else None
        network.load_state_dict(tensors)
        version, trained_on = int(metadata['version']), int(metadata['trained_on'])
        known = metadata['robot'], version, trained_on, trust, metadata['base']
        over = dict(json.loads(metadata['over']))
    except DAMAGE as error:
        raise UserError(
            f'{source}: not the weights of a difference model ({one_line(error)}); '
            'they come from /difference_model/weights'
        ) from error
    return DifferenceModel(network.eval(), layout, config, *known, over, source)


def _trust(tensors: dict[str, Tensor], outputs: int) -> Trust:
    """Take the ensemble's trust out of the tensors of a file."""
    names = [name for name in tensors if name.startswith(TRUST)]
    trust = Trust(**{name.removeprefix(TRUST): tensors.pop(name).numpy() for name in names})
    for name, array in trust.arrays().items():
        if array.shape != (outputs,) or (array < 0.0).any():
            raise ValueError(f'{TRUST}{name} is not of {outputs} numbers, 0 or more')
    if not (np.all(trust.error > 0.0) and np.all(trust.limit > 0.0)):
        raise ValueError(f'{TRUST}error or {TRUST}limit is 0')
    return trust


def read_difference(path: Path, robot: Robot) -> DifferenceModel:
    """Read the difference model of a robot; UserError where it is none, or of another robot."""
    if not path.is_file():
        raise UserError(f'no difference model {path}; model.yaml or --difference names it')
    difference = from_bytes(path.read_bytes(), str(path))
    difference.check(robot)
    return difference


def first_whole(
    paths: Iterable[Path], say: Callable[[str], None]
) -> tuple[bytes, DifferenceModel] | None:
    """The first file that holds a difference model, and what it holds; None where none does.

    What is wrong with those before it is said, a line each.
    """
    for path in paths:
        try:
            data = path.read_bytes()
            return data, from_bytes(data, str(path))
        except (UserError, OSError) as error:
            say(f'{error}; passed over')
    return None


def load_difference(path: Path, model: Model) -> DifferenceModel:
    """As `read_difference`; UserError also where it goes on top of another model."""
    difference = read_difference(path, model.robot)
    if said := differing(of_model(difference.beneath(model)), of_model(model)):
        raise UserError(
            f'{path} goes on top of a model with {said}; give the model that was written with it '
            f'({path.with_suffix(".yaml").name})'
        )
    return difference
