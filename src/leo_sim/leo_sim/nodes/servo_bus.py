# SPDX-License-Identifier: Apache-2.0
"""A bus of servos that do not exist: bytes on a pseudo-terminal, a simulated robot behind them.

leo run leo_sim servo_bus --ros-args -p robot:=leo -p link:=/tmp/leo_bus
leo run leo_sim robot --ros-args -p robot:=leo -p driver:=dynamixel -p port:=/tmp/leo_bus
leo param set /servo_bus lose 0.01
"""

from collections.abc import Callable
from dataclasses import fields
from functools import partial
import math
import sys
from threading import Event, Thread
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node

from leo_msgs_py.cli import executable
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import declared, fixed_parameter, graph, spare_collector, spin
from leo_sim.drivers.servo_bus.line import Line, Trouble
from leo_sim.drivers.servo_bus.plant import Plant
from leo_sim.drivers.servo_bus.rig import Terminal
from leo_sim.nodes.parameters import read_options

OVERHEATED, OVERLOADED = 0x04, 0x20
NONE = -1  # where a parameter asks for a servo's id: no servo
SWITCH = 1e-4  # how long the node may keep the servos' thread waiting for the interpreter [s]
EVENTS = ('restart', 'overheat', 'overload')  # what happens to a servo, each time it is set


class ServoBusNode(Node):
    """The rig in the graph: its troubles are parameters, to be set while it runs.

    `lose`, `late` (by `late_by` s), `cut`, `wrong_crc`, `rubbish`: share of packets, 0 to 1;
    `silent`, `restart`, `overheat`, `overload`: id of a servo, -1 for none; `supply` V;
    `bus_cable`, `usb_cable`: whether they are in; `start`: the pose it is put into by hand, where
    it is held until a motor is driven (unless `hand` is false).
    """

    def __init__(self) -> None:
        super().__init__('servo_bus')
        given = partial(fixed_parameter, self)
        options = read_options(self, 'servo_pendulum')
        bus = options.robot.driver.bus
        if bus is None:
            raise UserError(
                f'{options.robot.name} has no servos: give it some in robot.yaml, '
                'driver: dynamixel or feetech (docs/your_driver.md)'
            )
        nominal = next((a.supply for a in options.robot.actuators if a.supply), 12.0)
        supply = declared(self, 'supply', nominal)
        plant = Plant(options, supply, given('supply_resistance', 0.0), given('hand', True))
        trouble = Trouble(**{f.name: declared(self, f.name, f.default) for f in fields(Trouble)})
        line = Line(given('baud', 0) or bus.baud, trouble, options.seed)
        self.rig = Terminal(plant, line, given('link', ''), given('log', ''))
        self._acts = self._make_acts(trouble)
        for name in ('silent', *EVENTS):
            declared(self, name, NONE)
        for name in ('bus_cable', 'usb_cable'):
            declared(self, name, True)
        self.add_on_set_parameters_callback(self._on_parameters)

    def _make_acts(self, trouble: Trouble) -> dict[str, Callable[[Any], None]]:
        rig, plant = self.rig, self.rig.plant
        return {
            **{f.name: partial(setattr, trouble, f.name) for f in fields(trouble)},
            'silent': lambda n: setattr(rig.bus, 'silent', frozenset({n} - {NONE})),
            'restart': self._each(lambda servo: servo.restart()),
            'overheat': self._each(lambda servo: servo.fail(OVERHEATED)),
            'overload': self._each(lambda servo: servo.fail(OVERLOADED)),
            'supply': lambda volts: setattr(plant, 'open_circuit', volts),
            'bus_cable': lambda there: setattr(rig, 'bus_cable', there),
            'usb_cable': lambda there: rig.plug() if there else rig.unplug(),
            'start': plant.start_in,
        }

    def _each(self, act: Callable[[Any], None]) -> Callable[[int], None]:
        def on(number: int) -> None:
            if number != NONE:
                act(self.rig.bus.servos[number])

        return on

    def _on_parameters(self, parameters: list[Any]) -> SetParametersResult:
        for parameter in parameters:
            if why := self._objection(parameter.name, parameter.value):
                return SetParametersResult(successful=False, reason=why)
        for parameter in parameters:
            if parameter.name in self._acts:
                self.rig.order(partial(self._acts[parameter.name], parameter.value))
        return SetParametersResult(successful=True)

    def _objection(self, name: str, value: Any) -> str:
        if isinstance(value, float) and not (math.isfinite(value) and value >= 0.0):
            return f'{name} must be 0 or a positive number'
        known = self.rig.bus.servos
        if name in ('silent', *EVENTS) and value not in {NONE, *known}:
            return f'there is no servo {value}; there are {sorted(known)}'
        if name == 'start' and value not in self.rig.plant.robot.start_poses:
            return f'there is no start pose {value!r}'
        return ''


@executable
def main(argv: list[str]) -> int:
    with graph(argv):
        node = ServoBusNode()
        spare_collector()
        sys.setswitchinterval(SWITCH)
        ended = Event()
        thread = Thread(target=node.rig.run, args=(ended,), daemon=True)
        thread.start()
        servos = ', '.join(
            f'{joint} {servo.get("id")}' for joint, servo in node.rig.plant.servos.items()
        )
        node.get_logger().info(f'servos ({servos}) at {node.rig.port}')
        try:
            spin(node)
        finally:
            ended.set()
            thread.join()
    return 0
