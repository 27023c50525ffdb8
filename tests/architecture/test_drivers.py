# SPDX-License-Identifier: Apache-2.0
"""Only drivers know which driver runs."""

import ast

import pytest
from tests.architecture.source import imports, MODULES, within

DRIVERS = 'leo_sim.drivers'
HARDWARE = (DRIVERS, 'leo_sim.description.servos', 'dynamixel_sdk', 'scservo_sdk')
ANY_DRIVER = tuple(f'{DRIVERS}.{name}' for name in ('base', 'safety', 'apart', 'check'))
"""What every driver has; what stands between it and a command; the suite that tries any."""
ONE_DRIVER = (
    DRIVERS,
    'leo_sim.description',
    'leo_sim.verbs.skeleton',
    'leo_sim.verbs.robot',
    'leo_sim.nodes.servo_bus',
)
"""What knows of servos: drivers, their bus, robot.yaml and what writes it."""
LOADERS = ('leo_sim.nodes.robot', 'leo_sim.verbs.check_driver')  # what builds a driver by its name
BLIND = 'leo_lab.blind'  # makes its cases on the simulated driver, whatever runs elsewhere
KINDS = ('dynamixel', 'feetech', 'replay')


def of_one_driver(module: str, source: str) -> list[str]:
    """Name what a module knows of which driver runs: imports, and drivers' names as texts."""
    loads = [DRIVERS, f'{DRIVERS}.load_driver'] if module in LOADERS else []
    found = [
        name
        for name in imports(source, module)
        if any(within(name, place) for place in HARDWARE)
        and not any(within(name, place) for place in ANY_DRIVER)
        and name not in loads
    ]
    texts = [
        node.value
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Constant) and node.value in KINDS
    ]
    return [*found, *texts]


def test_nobody_but_drivers_knows_which_driver_runs() -> None:
    """Learner, recorder, play, Algorithm 5 and all verbs are the same with every driver."""
    others = [m for m in MODULES if not any(within(m, p) for p in (*ONE_DRIVER, BLIND))]
    known = {module: of_one_driver(module, MODULES[module].read_text()) for module in others}
    assert {module: names for module, names in known.items() if names} == {}


@pytest.mark.parametrize(
    'source',
    [
        "if driver == 'dynamixel':\n    pass",
        'from leo_sim.drivers.dynamixel import DynamixelDriver',
        'from leo_sim.drivers import load_driver',
        'import scservo_sdk',
    ],
)
def test_a_branch_on_the_driver_is_noticed(source: str) -> None:
    assert of_one_driver('leo_learner.learning.run', source)
