# SPDX-License-Identifier: Apache-2.0
"""The view as one HTML file that needs neither server nor network."""

from __future__ import annotations

from leo_diffmodel.picture import palette
from leo_diffmodel.report.page import render, source
from leo_diffmodel.report.section import Section
from leo_diffmodel.watch.page.horizon import FLOOR, HorizonView, words
from leo_diffmodel.watch.page.look import GIVEN, MEASURED, REPAIRED
from leo_diffmodel.watch.page.over_time import OverTimeView
from leo_diffmodel.watch.page.robot import RobotView
from leo_diffmodel.watch.state import State


def page(state: State) -> str:
    """What the page shows now, as HTML."""
    state.finish()
    views = RobotView(state), HorizonView(state), OverTimeView(state)
    values = {
        'words': words(state),
        'at': state.scene.timeline.words(state.player.now),
        'ahead': state.horizon,
        'rows': _rows(state),
        'legend': [('measured', MEASURED), ('as given', GIVEN), ('with the switches', REPAIRED),
                   ('noise floor', FLOOR)],
        'cursor': palette.INK,
    }  # fmt: skip
    section = Section('watch.html', values, tuple(view.plot for view in views))
    title = f'{state.scene.given.robot.name}: the model beside the robot'
    return render(title, source(state.scene.recordings), [section])


def _rows(state: State) -> list[dict]:
    """What is switched on."""
    return [
        {'label': label, 'without': state.without[label], 'with': state.sizes[1],
         'parameters': [(p.name, values[p.name], p.unit)
                        for p in state.scene.candidates[label].parameters]}
        for label, values in state.setting.on.items()
    ]  # fmt: skip
