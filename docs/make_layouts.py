# SPDX-License-Identifier: Apache-2.0
"""Layouts of the topics of a robot for Foxglove (JSON) and PlotJuggler (XML).

    python docs/make_layouts.py [ROBOT …] [-o docs/layouts]

Both show what the robot measures, what was commanded and what was applied, and the e-stop;
Foxglove also its diagnostics, and buttons that stop it and take that back.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import json
from pathlib import Path
from xml.etree import ElementTree

from leo_msgs_py import topics
from leo_msgs_py.topics import Service, Topic
from leo_sim.description.robot import load_robot, Robot
from leo_sim.drivers.base import INTERFACES

FOLDER = Path(__file__).with_name('layouts')
SHIPPED = 'pendulum', 'leo'
COLOURS = '#0b6fa4', '#c85a00', '#00795a', '#7a4b94', '#8a6d00', '#5b6775'
Curves = list[tuple[str, str]]
"""Of one figure: the joint, and the field of a message."""


def absolute(of: Topic | Service) -> str:
    """The name of a topic or service of a robot without a namespace."""
    return '/' + of.name.lstrip('/')


def figures(robot: Robot, indexed: bool) -> Iterator[tuple[str, Curves]]:
    """Titles with their curves.

    Args:
        robot: whose joints and actuators they are.
        indexed: joint states by number as in the message; else by name, as PlotJuggler has them.
    """
    states, actuated = robot.joint_names, [a.joint for a in robot.actuators]
    interface = INTERFACES[robot.input]
    field = 'position' if interface == 'position' else 'effort'
    unit = {'voltage': 'V', 'effort': 'N m', 'position': 'rad'}[interface]

    def joint(topic: Topic, names: list[str], what: str) -> Curves:
        paths = (f'.{what}[{i}]' if indexed else f'/{n}/{what}' for i, n in enumerate(names))
        return [(n, absolute(topic) + path) for n, path in zip(names, paths, strict=True)]

    values = absolute(topics.COMMANDS[interface]) + ('.data[{}]' if indexed else '/data[{}]')
    yield 'position [rad]', joint(topics.JOINT_STATES, states, 'position')
    yield 'velocity [rad/s]', joint(topics.JOINT_STATES, states, 'velocity')
    yield f'applied [{unit}]', joint(topics.APPLIED[interface], actuated, field)
    yield f'commanded [{unit}]', [(n, values.format(i)) for i, n in enumerate(actuated)]


def foxglove(robot: Robot) -> str:
    """A layout file of Foxglove, which Lichtblick reads as well."""
    plots = {
        f'Plot!{title.split()[0]}': _plot(title, curves)
        for title, curves in figures(robot, indexed=True)
    }
    panels = {
        **plots,
        'Indicator!stop': _lamp(),
        'CallService!stop': _button(topics.E_STOP, 'E-STOP', '#c92a2a'),
        'CallService!release': _button(topics.E_STOP_RESET, 'Release e-stop', '#5b6775'),
        'DiagnosticSummary!robot': {
            'topicToRender': absolute(topics.DIAGNOSTICS),
            'minLevel': 0,
            'pinnedIds': [],
            'hardwareIdFilter': '',
        },
    }
    buttons = _split('column', 50, 'CallService!stop', 'CallService!release')
    side = _split(
        'column', 15, 'Indicator!stop', _split('column', 65, buttons, 'DiagnosticSummary!robot')
    )
    first, second, third, fourth = plots
    halves = _split('column', 50, first, second), _split('column', 50, third, fourth)
    layout = {
        'configById': panels,
        'globalVariables': {},
        'userNodes': {},
        'playbackConfig': {'speed': 1},
        'layout': _split('row', 25, side, _split('column', 50, *halves)),
    }
    return json.dumps(layout, indent=1) + '\n'


def _split(direction: str, percent: int, first: object, second: object) -> dict:
    return {'direction': direction, 'splitPercentage': percent, 'first': first, 'second': second}


def _plot(title: str, curves: Curves) -> dict:
    paths = [
        {'value': path, 'enabled': True, 'timestampMethod': 'receiveTime', 'label': name}
        for name, path in curves
    ]
    return {
        'foxglovePanelTitle': title,
        'paths': paths,
        'showLegend': True,
        'isSynced': True,
        'legendDisplay': 'left',
        'showPlotValuesInLegend': False,
        'xAxisVal': 'timestamp',
        'showXAxisLabels': True,
        'showYAxisLabels': True,
        'sidebarDimension': 110,
    }


def _lamp() -> dict:
    rule = {'operator': '=', 'rawValue': 'true', 'color': '#c92a2a', 'label': 'e-stop'}
    return {
        'path': f'{absolute(topics.E_STOPPED)}.data',
        'style': 'background',
        'rules': [rule],
        'fallbackColor': '#00795a',
        'fallbackLabel': 'runs',
    }


def _button(service: Service, text: str, colour: str) -> dict:
    return {
        'serviceName': absolute(service),
        'requestPayload': '{}',
        'layout': 'horizontal',
        'buttonText': text,
        'buttonColor': colour,
    }


def plotjuggler(robot: Robot) -> str:
    """A layout file of PlotJuggler; it chooses the topics as well, so no dialog asks for them."""
    stopped = [('', f'{absolute(topics.E_STOPPED)}/data')]
    shown = [*figures(robot, indexed=False), ('e-stop', stopped)]
    root = ElementTree.Element('root')
    window = _under(root, 'tabbed_widget', name='Main Window', parent='main_window')
    tab = _under(window, 'Tab', tab_name=robot.name, containers='1')
    sizes = [0.24, 0.24, 0.2, 0.2, 0.12]
    splitter = _under(
        _under(tab, 'Container'),
        'DockSplitter',
        orientation='-',
        count=str(len(shown)),
        sizes=';'.join(map(str, sizes)),
    )
    for title, curves in shown:
        plot = _under(
            _under(splitter, 'DockArea', name=title),
            'plot',
            mode='TimeSeries',
            style='Lines',
            line_width='1.0',
            flip_x='false',
            flip_y='false',
        )
        _under(plot, 'limitY')
        for i, (_, path) in enumerate(curves):
            _under(plot, 'curve', name=path, color=COLOURS[i % len(COLOURS)])
    _under(window, 'currentTabIndex', index='0')
    _under(root, 'use_relative_time_offset', enabled='1')
    _chosen(root, robot)
    ElementTree.indent(root, ' ')
    text = ElementTree.tostring(root, 'unicode')
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _chosen(root: ElementTree.Element, robot: Robot) -> None:
    interface = INTERFACES[robot.input]
    names = [
        absolute(t)
        for t in (
            topics.JOINT_STATES,
            topics.APPLIED[interface],
            topics.COMMANDS[interface],
            topics.E_STOPPED,
        )
    ]
    plugin = _under(_under(root, 'Plugins'), 'plugin', ID='DataLoad MCAP')
    _under(
        plugin,
        'parameters',
        selected_topics=';'.join(names),
        use_timestamp='0',
        use_mcap_log_time='0',
        clamp_large_arrays='1',
        max_array_size='500',
    )


def _under(above: ElementTree.Element, tag: str, **attributes: str) -> ElementTree.Element:
    return ElementTree.SubElement(above, tag, attributes)


def written(name: str, folder: Path) -> list[Path]:
    """Write both layouts of a robot."""
    robot = load_robot(name)
    made = {f'{robot.name}_foxglove.json': foxglove, f'{robot.name}_plotjuggler.xml': plotjuggler}
    folder.mkdir(parents=True, exist_ok=True)
    for file, make in made.items():
        (folder / file).write_text(make(robot))
    return [folder / file for file in made]


def main() -> None:
    """Write the layouts of the robots that are named."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('robots', nargs='*', metavar='ROBOT', help='names or folders of robots')
    parser.add_argument('-o', type=Path, default=FOLDER, metavar='DIR')
    given = parser.parse_args()
    for name in given.robots or SHIPPED:
        print('wrote', *written(name, given.o))


if __name__ == '__main__':
    main()
