# SPDX-License-Identifier: Apache-2.0
"""leo explain beside MuJoCo's system identification toolbox, on the same bag of a pendulum.

    pip install -r benchmarks/requirements-bench.txt
    python benchmarks/mujoco_sysid.py

A torque-driven pendulum hides one effect; 20 s at 100 Hz are recorded with noise. Both learn from
the first 15 s and are scored on the last 5 s. MuJoCo is told which parameter is wrong, its bounds
and the noise of both sensors; leo gets the bag, the model and its catalogue. MuJoCo takes the
start of a run as exact, so it is tried on the whole run and on pieces of 1 s that start from the
measured state. The score is the rms angle error of 0.5 s windows that start from the measured
state, predicted by the same Model with the value that each has found.
"""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from dataclasses import replace
import io
import time

import mujoco
from mujoco import sysid
import numpy as np
from rich.console import Console
from rich.table import Table
from rig import simulated

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import cut
from leo_diffmodel.explain.explanation import explain
from leo_sim.description.robot import load_robot, Robot
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout

CASES = (
    ('viscous_friction', 'b', 0.05, 'damping', 1.0),
    ('coulomb_friction', 'c', 0.15, 'frictionloss', 2.0),
    ('armature', 'J', 0.02, 'armature', 0.2),
)
TRAIN, SECONDS, NOISE, STEP = 15.0, 20.0, (0.001, 0.05), 0.005
PIECE = 1.0


def xml(robot: Robot) -> str:
    """The pendulum as MuJoCo model: one hinge, figures of robot.yaml."""
    c = {path: constant.value for path, constant in robot.constants.items()}
    inertia = c['links.bob.inertia']
    return f"""
<mujoco>
  <option timestep="{STEP}" integrator="implicitfast" gravity="0 0 -{c['gravity']}"/>
  <worldbody>
    <body name="bob">
      <joint name="pivot" type="hinge" axis="0 -1 0"
             armature="{c['actuators.pivot.rotor_inertia']}"/>
      <inertial pos="{c['links.bob.com_x']} 0 {c['links.bob.com_z']}" mass="{c['links.bob.mass']}"
                diaginertia="{inertia} {inertia} {inertia}"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="pivot"/></actuator>
  <sensor><jointpos name="angle" joint="pivot"/><jointvel name="rate" joint="pivot"/></sensor>
</mujoco>"""


def pieces(recording: Recording, seconds: float) -> list[slice]:
    """Consecutive stretches of an episode."""
    count = len(recording.episodes[0].t)
    size = min(round(seconds / 0.01), count - 1)
    return [slice(i, i + size + 1) for i in range(0, count - size, size)]


def sequences(robot: Robot, recording: Recording, seconds: float) -> sysid.ModelSequences:
    """The recording as the toolbox takes it: start states, held torques, both sensors."""
    spec = mujoco.MjSpec.from_string(xml(robot))
    model, (e,) = spec.compile(), recording.episodes
    names, starts, controls, sensors = [], [], [], []
    for i, part in enumerate(pieces(recording, seconds)):
        t = e.t[part] - e.t[part.start]
        fine = np.arange(round(t[-1] / STEP) + 1) * STEP
        held = sysid.TimeSeries(t, e.inputs[part]).interpolate(fine + 1e-6, 'zoh')
        seen = np.concatenate([e.q[part], e.dq[part]], axis=1)
        names.append(f'piece {i}')
        starts.append(sysid.create_initial_state(model, e.q[part.start], e.dq[part.start]))
        controls.append(sysid.TimeSeries(fine, held))
        sensors.append(sysid.TimeSeries.from_names(t, seen, model))
    return sysid.ModelSequences('pendulum', spec, names, starts, controls, sensors)


def with_mujoco(
    robot: Robot, recording: Recording, name: str, high: float, seconds: float
) -> float:
    """The value that the toolbox finds for one parameter of the joint."""

    def modify(spec: mujoco.MjSpec, parameter: sysid.Parameter) -> None:
        value = getattr(spec.joint('pivot'), name)
        setattr(spec.joint('pivot'), name, _like(value, float(parameter.value[0]) + base))

    base = robot.constants['actuators.pivot.rotor_inertia'].value if name == 'armature' else 0.0
    parameters = sysid.ParameterDict()
    parameters.add(sysid.Parameter(name, 0.0, 0.0, high, modifier=modify))
    parameters[name].value[:] = 0.05 * high
    residual = sysid.build_residual_fn(
        models_sequences=[sequences(robot, recording, seconds)],
        sensor_weights={'angle': 1 / NOISE[0], 'rate': 1 / NOISE[1]},
    )
    with contextlib.redirect_stdout(io.StringIO()):
        found, _ = sysid.optimize(parameters, residual, verbose=False)
    return float(found[name].value[0])


def _like(value: object, number: float) -> object:
    """Some joint figures are polynomials; the first term is the usual one."""
    return number if np.ndim(value) == 0 else np.r_[number, np.zeros(np.size(value) - 1)]


def error(model: Model, recording: Recording) -> float:
    """Rms angle error over windows of 0.5 s from the measured start [rad]."""
    windows = cut([recording], 0.5, stride=0.05)
    q, _ = rollout(model, windows.q[:, 0], windows.dq[:, 0], windows.inputs, windows.dt)
    return float(np.sqrt(((windows.q - q) ** 2).mean()))


def part(recording: Recording, begin: float, end: float) -> Recording:
    """The stretch from `begin` to `end` [s]."""
    (e,) = recording.episodes
    keep = (e.t >= begin) & (e.t < end)
    cutout = {name: value[keep] for name, value in vars(e).items() if value is not None}
    return replace(recording, episodes=(replace(e, **cutout),))


def timed(work: Callable[[], object]) -> tuple[object, float, float]:
    """The result, seconds by the wall and seconds of processor time."""
    wall, used = time.perf_counter(), time.process_time()
    result = work()
    return result, time.perf_counter() - wall, time.process_time() - used


def main() -> None:
    """All cases, side by side."""
    robot = load_robot('torque_pendulum')
    table = Table('hidden', 'by', 'answer', 'held-out error [rad]', 'wall [s]', 'processor [s]')
    for name, symbol, value, joint, high in CASES:
        hidden = place(robot, name, 'pivot', **{symbol: value})
        bag = simulated(Model(robot, [hidden]), SECONDS, NOISE)
        train, held = part(bag, 0.0, TRAIN), part(bag, TRAIN, SECONDS)
        found = timed(lambda train=train: explain([train], Model(robot)))
        rows = [('leo, whole catalogue', found[0].sentence.split(';')[0], found[0].model, found)]
        for label, seconds in (('MuJoCo, told, whole run', TRAIN), ('MuJoCo, told, 1 s', PIECE)):
            done = timed(lambda a=(robot, train, joint, high, seconds): with_mujoco(*a))
            repaired = Model(robot, [place(robot, name, 'pivot', **{symbol: done[0]})])
            rows.append((label, f'{joint} = {done[0]:.5f}', repaired, done))
        rows += [('the truth', f'{symbol} = {value}', Model(robot, [hidden]), None)]
        rows += [('the model as given', '-', Model(robot), None)]
        for label, answer, model, took in rows:
            spent = ('-', '-') if took is None else (f'{took[1]:.1f}', f'{took[2]:.1f}')
            table.add_row(name, label, answer, f'{error(model, held):.5f}', *spent)
    Console(width=150).print(table)


if __name__ == '__main__':
    main()
