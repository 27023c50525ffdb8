# SPDX-License-Identifier: Apache-2.0
"""What compare and explain answer, as frozen dataclasses.

Names are those of compare.json and explain.json. Lists over states are in the order of `states`:
all positions, then all rates.
"""

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
    """Root mean square error of a prediction from a measured start."""

    seconds: float  # how far ahead [s]
    rmse: tuple[float, ...]  # per state, in its unit
    noise_floor: tuple[float, ...]  # what a perfect model would score on this data, per state


@dataclass(frozen=True)
class Lack:
    """The torque a model lacks at a joint, over all the data."""

    joint: str  # where
    share: float  # of the error beyond noise, 0 to 1
    torque_nm: float  # rms beyond noise [N m; on slides N, as `torque_unit` says]
    torque_unit: str  # its unit
    noise_nm: float  # rms that noise alone gives
    mean_nm: float  # mean, with its sign
    volts: float | None  # the motor voltage that would give it; None on a joint without a voltage
    stall_percent: float | None  # of the motor's stall torque; None on a joint without a motor


@dataclass(frozen=True)
class Place(Lack):
    """The torque a model lacks at a joint in one bin of a variable."""

    variable: str  # rate, angle, input, load, direction, time, …
    bin: tuple[float, float] | str  # its range, or a word
    unit: str  # of the range
    data_share: float  # of the joint's time that lies in the bin, 0 to 1
    windows: tuple[tuple[float, float], ...]  # worst first [s from the first state]
    bags: tuple[int, ...]  # for each of them which bag, from 0


@dataclass(frozen=True)
class Budget:
    """Shares of the measured motion over half a second: they add up to 1."""

    explained: float
    unexplained: float
    noise: float


@dataclass(frozen=True)
class Comparison:
    """How wrong a model is on recordings."""

    states: tuple[State, ...]  # what is predicted
    errors: tuple[Error, ...]  # one control period ahead, then further, the nearest first
    budget: Budget  # how much of the motion is explained, missed and noise
    joints: tuple[Lack, ...]  # the missing torque by joint
    where: tuple[Place, ...]  # by joint, variable and bin, worst first
    noise_only: bool  # no torque is missing beyond noise
    json: dict[str, Any] = field(repr=False, compare=False)  # the contents of compare.json

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
    """A refitted constant."""

    # by their names, where each has a value of its own; `value` is then the mean
    recordings: dict[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Rival:
    """What else could stand in the place of an effect."""

    name: str  # of the effect
    where: str | tuple[str, ...]  # joint or link, a list of them, or `all`
    separable_nats: float  # by how much this data prefer the effect to it
    same_thing: str | None  # why no data of this kind can tell them apart; None where some can


@dataclass(frozen=True)
class NamedEffect:
    """An effect with its fitted parameters and the evidence for it."""

    name: str  # of the effect
    where: str | tuple[str, ...]  # joint or link, a list of them, or `all`
    parameters: dict[str, Value]  # by name
    gain_train: float  # loss saved on the data it was fitted to [nats]
    gain_held_out: float | None  # on other data [nats]; None where it was only scanned
    error_before: float  # held-out error without it, mean over the states
    error_after: float | None  # with it; None where it was only scanned
    inclusion_probability: float  # share of the held-out turns that choose it
    confusable_with: tuple[Rival, ...]  # nearest first
    source: str | None = None  # the Python file of an effect of the user's own


@dataclass(frozen=True)
class NotTestable:
    """An effect that this data cannot show, and why."""

    name: str
    where: str | tuple[str, ...]
    why: str


@dataclass(frozen=True)
class Change:
    """Held-out error before and after the repair, beside what noise alone gives; per state."""

    seconds: float  # how far ahead [s]
    before: tuple[float, ...]  # of the model as given
    after: tuple[float, ...]  # of the repaired model
    noise_floor: tuple[float, ...]  # of a perfect one


@dataclass(frozen=True)
class Explanation:
    """Which physical effect a model lacks."""

    verdict: Verdict  # one of `Verdict`
    sentence: str  # the answer in plain words
    states: tuple[State, ...]  # what is predicted; empty where nothing was fitted
    effects: tuple[NamedEffect, ...]  # the supported ones
    constants: dict[str, Constant]  # uncertain ones as refitted, by path in robot.yaml
    hypotheses: tuple[NamedEffect, ...]  # all candidates, each on the model as given, best first
    not_testable: tuple[NotTestable, ...]  # what this data cannot show
    next_run: str | None  # what to record next, in words; None where nothing is open
    errors: tuple[Change, ...]  # on held-out data, the nearest first
    seconds: float  # what it took
    model: Model = field(repr=False, compare=False)  # repaired, or as given if none was named
    json: dict[str, Any] = field(repr=False, compare=False)  # the contents of explain.json
    complete: bool = True  # False where the time was over before the search was
    edit_test: dict[str, Any] | None = None  # None without bags of a changed robot
    not_sure: tuple[NamedEffect, ...] = ()  # fitted beside the effects that a `partly` is sure of

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
