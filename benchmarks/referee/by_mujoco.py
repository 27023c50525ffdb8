# SPDX-License-Identifier: Apache-2.0
"""MuJoCo's system identification toolbox, told the parameters that a person would pick.

The model as given is exported as MJCF. The toolbox fits the figures that the card lists to pieces
of the logs by their angles, from measured starts; what it finds is put into our model, so that
all are scored alike.
"""

from __future__ import annotations

import contextlib
from functools import partial
import io
from typing import Any

from benchmarks.referee.card import Rig
from benchmarks.referee.contenders import Fitted
from benchmarks.rig import starts
import mujoco
from mujoco import sysid
import numpy as np

from leo_diffmodel.compare.windows import cut, thin, Windows
from leo_sim.effects import place
from leo_sim.export.mjcf import mjcf
from leo_sim.model import Model
from leo_sim.references.mjcf import written

PIECE = 1.0  # s
STEP = 0.001
"""s, the longest time step of its simulation."""
EFFECTS = {
    'damping': ('viscous_friction', 'b'),
    'frictionloss': ('coulomb_friction', 'c'),
    'armature': ('armature', 'J'),
    'gain': ('voltage_scale', 'k'),
}
"""What a figure of MJCF is in our model. Of all but the gain what is added to the model's."""


def fitted(rig: Rig) -> Fitted:
    """The figures `mujoco` of the card, as effects of our model."""
    learn = thin(list(rig.learn))
    windows = cut(learn, PIECE, stride=PIECE)
    windows = windows.take(windows.enabled.all(axis=(1, 2)))
    parameters = _parameters(rig)
    residual = sysid.build_residual_fn(
        models_sequences=[_sequences(rig.model, windows, starts(learn, windows))],
        sensor_weights=dict.fromkeys(rig.model.robot.joint_names, 1.0),
    )
    with contextlib.redirect_stdout(io.StringIO()):
        found, _ = sysid.optimize(parameters, residual, verbose=False)
    values = {figure: float(found[figure].value[0]) for figure in rig.card.mujoco}
    said = ', '.join(f'{figure} = {value:.4g}' for figure, value in values.items())
    return Fitted(with_figures(rig.model, values), said)


def with_figures(model: Model, values: dict[str, float]) -> Model:
    """Our model with what MuJoCo found."""
    effects, constants = list(model.effects), dict(model.constants)
    for figure, value in values.items():
        kind, _, where = figure.partition(':')
        if kind == 'mass':
            constants[f'links.{where}.mass'] = value
            continue
        name, parameter = EFFECTS[kind]
        effects.append(place(model.robot, name, where, **{parameter: value}))
    return model.changed(effects=effects, constants=constants)


def _parameters(rig: Rig) -> Any:
    given = mujoco.MjSpec.from_string(written(mjcf(rig.model))).compile()
    parameters = sysid.ParameterDict()
    for figure in rig.card.mujoco:
        kind, _, where = figure.partition(':')
        value, low, high = _range(rig, given, kind, where)
        change = partial(_MODIFY[kind], where=where, base=_base(given, kind, where))
        parameters.add(sysid.Parameter(figure, value, low, high, modifier=change))
    return parameters


def _range(rig: Rig, given: Any, kind: str, where: str) -> tuple[float, float, float]:
    """Where a figure starts, and its bounds; a person knows the order of magnitude."""
    if kind == 'gain':
        return 1.0, 0.3, 2.0
    if kind == 'mass':
        mass = float(given.body(where).mass[0])
        return mass, 0.5 * mass, 2.0 * mass
    most = rig.model.robot.limits.max(initial=0.0) if rig.model.robot.input == 'torque' else 1.0
    most = {'armature': 0.2, 'damping': most or 1.0, 'frictionloss': most or 1.0}[kind]
    return 0.02 * most, 0.0, most


def _base(given: Any, kind: str, where: str) -> float:
    """The figure in the model as given."""
    if kind in ('gain', 'mass'):
        return float(given.actuator(where).gainprm[0]) if kind == 'gain' else 0.0
    at = given.joint(where).dofadr[0]
    figures = {
        'damping': given.dof_damping,
        'frictionloss': given.dof_frictionloss,
        'armature': given.dof_armature,
    }
    return float(figures[kind][at])


def _of_joint(attribute: str, spec: Any, parameter: Any, where: str, base: float) -> None:
    joint, value = spec.joint(where), base + float(parameter.value[0])
    old = getattr(joint, attribute)
    setattr(joint, attribute, value if np.ndim(old) == 0 else [value, *np.zeros(np.size(old) - 1)])


def _gain(spec: Any, parameter: Any, where: str, base: float) -> None:
    actuator = spec.actuator(where)
    actuator.gainprm = [base * float(parameter.value[0]), *actuator.gainprm[1:]]


def _mass(spec: Any, parameter: Any, where: str, base: float) -> None:
    spec.body(where).mass = float(parameter.value[0])


_MODIFY = {
    **{name: partial(_of_joint, name) for name in ('damping', 'frictionloss', 'armature')},
    'gain': _gain,
    'mass': _mass,
}


def _sequences(
    model: Model, windows: Windows, begin: tuple[np.ndarray, np.ndarray]
) -> sysid.ModelSequences:
    """The pieces as the toolbox takes them: start states, held inputs, sensors of every joint."""
    spec = mujoco.MjSpec.from_string(written(mjcf(model)))
    spec.option.timestep = min(STEP, float(np.median(windows.dt)))
    for joint in model.robot.joint_names:
        spec.add_sensor(
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            name=joint,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=joint,
        )
    compiled = spec.compile()
    names, states, controls, sensors = [], [], [], []
    for i in range(windows.count):
        t = np.concatenate([[0.0], np.cumsum(windows.dt[i])])
        fine = np.arange(round(t[-1] / spec.option.timestep) + 1) * spec.option.timestep
        held = windows.inputs[i][np.clip(np.searchsorted(t, fine + 1e-6) - 1, 0, len(t) - 2)]
        names.append(f'piece {i}')
        states.append(sysid.create_initial_state(compiled, begin[0][i], begin[1][i]))
        controls.append(sysid.TimeSeries(fine, held))
        sensors.append(sysid.TimeSeries.from_names(t, windows.q[i], compiled))
    return sysid.ModelSequences(model.robot.name, spec, names, states, controls, sensors)
