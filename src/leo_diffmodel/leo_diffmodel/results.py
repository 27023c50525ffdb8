# SPDX-License-Identifier: Apache-2.0
"""What compare and explain answer, as frozen dataclasses.

Names are those of compare.json and explain.json. Lists over states are in the order of `states`:
all positions, then all rates.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, Self

from pydantic import ConfigDict, TypeAdapter

from leo_sim.model import Model

Verdict = Literal['fine', 'named', 'partly', 'ambiguous', 'unknown', 'untestable']
SURE = ('fine', 'named')


@dataclass(frozen=True)
class State:
    """A number that is measured, and its unit."""

    name: str
    unit: str


@dataclass(frozen=True)
class Error:
    """Root mean square error of a prediction from a measured start.

    Attributes:
        seconds: how far ahead [s].
        rmse: per state, in its unit.
        noise_floor: what a perfect model would score on this data, per state.
    """

    seconds: float
    rmse: tuple[float, ...]
    noise_floor: tuple[float, ...]


@dataclass(frozen=True)
class Lack:
    """The torque a model lacks at a joint, over all the data.

    Attributes:
        joint: where.
        share: of the error beyond noise, 0 to 1.
        torque_nm: rms beyond noise [N m; on slides N, as `torque_unit` says].
        torque_unit: its unit.
        noise_nm: rms that noise alone gives.
        mean_nm: mean, with its sign.
        volts: the motor voltage that would give it; None on a joint without a voltage.
        stall_percent: of the motor's stall torque; None on a joint without a motor.
    """

    joint: str
    share: float
    torque_nm: float
    torque_unit: str
    noise_nm: float
    mean_nm: float
    volts: float | None
    stall_percent: float | None


@dataclass(frozen=True)
class Place(Lack):
    """The torque a model lacks at a joint in one bin of a variable.

    Attributes:
        variable: rate, angle, input, load, direction, time, …
        bin: its range, or a word.
        unit: of the range.
        data_share: of the joint's time that lies in the bin, 0 to 1.
        windows: worst ones first, (begin, end) [s from the first state].
        bags: for each of them which bag, from 0.
    """

    variable: str
    bin: tuple[float, float] | str
    unit: str
    data_share: float
    windows: tuple[tuple[float, float], ...]
    bags: tuple[int, ...]


@dataclass(frozen=True)
class Budget:
    """Shares of the measured motion over half a second: they add up to 1."""

    explained: float
    unexplained: float
    noise: float


@dataclass(frozen=True)
class Comparison:
    """How wrong a model is on recordings.

    Attributes:
        states: what is predicted.
        errors: one control period ahead, then further, the nearest first.
        budget: how much of the motion is explained, missed and noise.
        joints: the missing torque by joint.
        where: by joint, variable and bin, worst first.
        noise_only: no torque is missing beyond noise.
        json: the contents of compare.json.
    """

    states: tuple[State, ...]
    errors: tuple[Error, ...]
    budget: Budget
    joints: tuple[Lack, ...]
    where: tuple[Place, ...]
    noise_only: bool
    json: dict[str, Any] = field(repr=False, compare=False)

    @classmethod
    def of(cls, data: dict[str, Any]) -> Self:
        """From the contents of compare.json."""
        floors = data['noise_floor']['horizon']
        errors = [
            {**row, 'noise_floor': floor['rmse']}
            for row, floor in zip(data['horizon'], floors, strict=True)
        ]
        return TypeAdapter(cls).validate_python({**data, 'errors': errors, 'json': data})


@dataclass(frozen=True)
class Value:
    """A fitted value, its unit, and the interval that holds it with 95 % confidence."""

    value: float
    unit: str
    ci95: tuple[float, float]


@dataclass(frozen=True)
class Constant(Value):
    """A refitted constant.

    Attributes:
        recordings: by their names, where each has a value of its own; `value` is then the mean.
    """

    recordings: dict[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Rival:
    """What else could stand in the place of an effect.

    Attributes:
        name: of the effect.
        where: joint or link, a list of them, or `all`.
        separable_nats: by how much this data prefer the effect to it.
        same_thing: why no data of this kind can tell them apart; None where some can.
    """

    name: str
    where: str | tuple[str, ...]
    separable_nats: float
    same_thing: str | None


@dataclass(frozen=True)
class NamedEffect:
    """An effect with its fitted parameters and the evidence for it.

    Attributes:
        name: of the effect.
        where: joint or link, a list of them, or `all`.
        parameters: by name.
        gain_train: loss saved on the data it was fitted to [nats].
        gain_held_out: on data it was not fitted to [nats]; None where it was only scanned.
        error_before: held-out error without it, mean over the states.
        error_after: with it; None where it was only scanned.
        inclusion_probability: share of the held-out turns that choose it.
        confusable_with: nearest first.
        source: the Python file of an effect of the user's own; None for a known one.
    """

    name: str
    where: str | tuple[str, ...]
    parameters: dict[str, Value]
    gain_train: float
    gain_held_out: float | None
    error_before: float
    error_after: float | None
    inclusion_probability: float
    confusable_with: tuple[Rival, ...]
    source: str | None = None


@dataclass(frozen=True)
class NotTestable:
    """An effect that this data cannot show, and why."""

    name: str
    where: str | tuple[str, ...]
    why: str


@dataclass(frozen=True)
class Change:
    """Held-out error before and after the repair, beside what noise alone gives; per state.

    Attributes:
        seconds: how far ahead [s].
        before: of the model as given.
        after: of the repaired model.
        noise_floor: of a perfect one.
    """

    seconds: float
    before: tuple[float, ...]
    after: tuple[float, ...]
    noise_floor: tuple[float, ...]


@dataclass(frozen=True)
class Explanation:
    """Which physical effect a model lacks.

    Attributes:
        verdict: one of `Verdict`.
        sentence: the answer in plain words.
        states: what is predicted; empty where nothing was fitted.
        effects: the supported ones.
        constants: uncertain constants of the robot as refitted with them, by path in robot.yaml.
        hypotheses: all candidates, each alone on the model as given, best first.
        not_testable: what this data cannot show.
        next_run: what to record next, in words; None where nothing is open.
        errors: on held-out data, the nearest first.
        seconds: what it took.
        model: the repaired model; the model as given where nothing was named.
        json: the contents of explain.json.
        edit_test: its `edit_test`; None where no bags of a changed robot were given.
    """

    verdict: Verdict
    sentence: str
    states: tuple[State, ...]
    effects: tuple[NamedEffect, ...]
    constants: dict[str, Constant]
    hypotheses: tuple[NamedEffect, ...]
    not_testable: tuple[NotTestable, ...]
    next_run: str | None
    errors: tuple[Change, ...]
    seconds: float
    model: Model = field(repr=False, compare=False)
    json: dict[str, Any] = field(repr=False, compare=False)
    edit_test: dict[str, Any] | None = None

    __pydantic_config__ = ConfigDict(arbitrary_types_allowed=True)

    @classmethod
    def of(cls, data: dict[str, Any], model: Model) -> Self:
        """From the contents of explain.json and the repaired model."""
        tables = data['errors']
        listed = {'states': tables.get('states', ()), 'errors': tables.get('horizon', ())}
        return TypeAdapter(cls).validate_python({**data, **listed, 'model': model, 'json': data})

    @property
    def sure(self) -> bool:
        """Whether the answer is closed: nothing is missing, or what is missing is named."""
        return self.verdict in SURE
