# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with a log: the faults of catalogue.yaml. Who looks for one is elsewhere."""

from collections.abc import Callable, Mapping, Sequence
import math
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, TypeAdapter

from leo_sim.common.yaml_file import Fixed, parsed

Patch = Mapping[str, Any]
"""Keys of one joint in a topic map, or of the map itself, that undo a fault."""
MADE: dict[Any, Callable[[float, Sequence[str]], Any]] = {
    'size': lambda size, _: size,
    '-size': lambda size, _: -size,
    '1 / size': lambda size, _: 1 / size,
    'names': lambda _, names: dict(zip(names[::2], names[1::2], strict=True)),
}
"""Values of a patch that are made of the size of a fault, or of the joints that it is about."""


class Fault(Fixed):
    """Something that can be wrong with a log."""

    name: str  # stable, for programs
    what: str  # a sentence
    channel: Literal['angle', 'speed', 'input', 'time']
    whole_log: bool = False  # it is one for all joints
    unit: str = ''  # of its size; '' for a factor
    turn: float = math.inf  # sizes that differ by it are the same; infinite where none are
    law: str  # what is logged, of what happened
    harmless: tuple[float, float] = (0.0, 0.0)
    """Sizes that a good log may have, lowest and highest; outside it is an error."""
    harmless_words: str = ''  # the same where it is not a size in the fault's unit
    looks_like: str  # a sentence
    confused_with: str  # a sentence
    costs: str  # what it does to an answer if it is not seen, a sentence
    mend: dict[str, Any] = Field(default_factory=dict)
    """Keys of a topic map that undo it, each with its value, or with what that is `MADE` of."""
    mended_above: float = -math.inf  # the size from which on a map undoes it
    todo: str = ''  # what to do where no map undoes it

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        """What undoes it in a topic map, by the names of its joints; empty where no map can."""
        mend = self.mend if value > self.mended_above else {}
        return {key: MADE[v](value, names) if v in MADE else v for key, v in mend.items()}


_listed = TypeAdapter(list[Fault]).validate_python(parsed(Path(__file__).with_suffix('.yaml')))
FAULTS = {fault.name: fault for fault in _listed}
"""By name."""
