# SPDX-License-Identifier: Apache-2.0
"""The torque a joint lacks against a variable, and what the switches make of it."""

from __future__ import annotations

from typing import Any

from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource, Select
from markupsafe import Markup
import numpy as np

from leo_diffmodel.compare.sizes import torque_unit
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.picture import palette
from leo_diffmodel.report.binned import (
    Binned,
    FEWEST,
    lacking,
    that_matters,
    torque_canvas,
    variables,
)
from leo_diffmodel.report.canvas import hover
from leo_diffmodel.watch.page.look import CARD, said, Silence, small, WIDE
from leo_diffmodel.watch.state import State

Array = np.ndarray
NOTE = (
    'Grey: the constant torque that would explain each short window with the model as given; '
    'black: mean of a bin ± its standard error. Blue: what the same estimate would show if what '
    'is switched on were all that is missing.'
)
HEAD = Markup('<b>Torque the model lacks</b> ')
NO_MEANS: dict[str, Any] = {name: [] for name in ('x', 'y', 'low', 'high', 'curve0')}


class MissingView:
    """The plot, and which joint and variable it shows."""

    def __init__(self, state: State) -> None:
        self._state, self._silent = state, Silence()
        self._shown: tuple[object, ...] = ()
        self._dots = ColumnDataSource({'x': [], 'y': []}, name='missing torque')
        self._means = ColumnDataSource(NO_MEANS, name='binned torque')
        self._joint = Select(title='joint', width=160, name='joint')
        self._variable = Select(title='against', width=260, name='against')
        self._joint.on_change('value', lambda _, __, v: self._ask(int(v)))
        self._variable.on_change('value', lambda _, __, v: self._ask(None, int(v)))
        sources = self._dots, self._means
        self.plot, means = torque_canvas(*sources, [palette.REPAIRED], name='missing plot')
        hover(self.plot, means, [('mean', '@y{0.000}'), ('at', '@x{0.000}')])
        self._words = said(**WIDE, name='missing says')
        head = row(self._joint, self._variable, self._words, **WIDE)
        self.root = column(head, self.plot, stylesheets=[CARD], **WIDE)
        self.refresh()

    def refresh(self) -> None:
        """Draw what is new."""
        lacks = self._state.lacks
        self._words.text = HEAD + small(lacks.trouble or NOTE)
        if lacks.given is None:
            return
        missing = lacks.given.missing
        self._choose(missing)
        shown = missing, lacks.curve, self._state.chosen
        if [*map(id, shown)] != [*map(id, self._shown)]:
            self._shown = shown
            self._draw(missing, lacks.curve)

    def _choose(self, missing: MissingTorque) -> None:
        """A first joint, and another where nothing shows of the one that was chosen."""
        chosen = self._state.chosen
        if chosen is None or chosen[0] not in _joints(missing):
            self._state.chosen = self._matters(missing, lacking(missing)[0])

    def _matters(self, missing: MissingTorque, joint: int) -> tuple[int, int]:
        """A joint with the variable that says most of what it lacks."""
        return joint, that_matters(missing, self._state.scene.model.robot, joint)

    def _draw(self, missing: MissingTorque, curve: Array | None) -> None:
        robot, (joint, number) = self._state.scene.model.robot, self._state.chosen or (0, 0)
        axes, names = variables(missing, robot, joint), robot.joint_names
        number = min(number, len(axes) - 1)
        joints = [(str(j), names[j]) for j in _joints(missing)]
        labels = [(str(i), label) for i, (label, _) in enumerate(axes)]
        with self._silent:
            self._joint.update(options=joints, value=str(joint))
            self._variable.update(options=labels, value=str(number))
        seen, (label, values) = missing.seen[:, joint], axes[number]
        heights = np.full(int(seen.sum()), np.nan) if curve is None else curve[seen, joint]
        unit = torque_unit(robot, names[joint])
        binned = Binned.of(values[seen], missing.torque[seen, joint], [heights], unit)
        self._dots.data, self._means.data = dict(binned.dots), dict(binned.means)
        binned.label(self.plot, label)

    def _ask(self, joint: int | None, number: int | None = None) -> None:
        """Have another joint shown, against what matters there, or another variable."""
        given, chosen = self._state.lacks.given, self._state.chosen
        if self._silent or given is None or chosen is None:
            return
        if joint is not None:
            self._state.choose(*self._matters(given.missing, joint))
        elif number is not None:
            self._state.choose(chosen[0], number)


def _joints(missing: MissingTorque) -> list[int]:
    """Those of which enough shows to be drawn; the foremost where none does."""
    count = missing.seen.sum(axis=0)
    return [j for j, n in enumerate(count) if n >= FEWEST] or lacking(missing)[:1]
