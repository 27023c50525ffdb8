# SPDX-License-Identifier: Apache-2.0
"""PyBullet as the body of a model. The only module that imports pybullet.

Settings as docs/reference/bullet.md 3 found them necessary for bit-identical steps. Stops,
damping and dry friction are laws of the model and switched off here.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
import ctypes
import os
import sys
import tempfile
from typing import Any
import weakref

import numpy as np

from leo_sim.common.broadcasting import Array
from leo_sim.description import urdf
from leo_sim.description.urdf import Body, Joint
from leo_sim.dynamics.inertia import Dynamics


@contextmanager
def quiet() -> Iterator[None]:
    """Send file descriptors 1 and 2 to nowhere; PyBullet prints on import and on connect.

    Python exceptions are not touched; stdout carries the JSON of our commands.
    """
    c = ctypes.CDLL(None)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    c.fflush(None)
    kept = os.dup(1), os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for target in (1, 2):
            os.dup2(nowhere, target)
        yield
    finally:
        c.fflush(None)
        for target, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, target)
            os.close(copy)
        os.close(nowhere)


with quiet():
    import pybullet

SOLVER = {'numSubSteps': 0, 'numSolverIterations': 10, 'deterministicOverlappingPairs': 1}
COLD = {'warmStartingFactor': 0.0, 'solverResidualThreshold': 0.0}
UNDAMPED = {'linearDamping': 0, 'angularDamping': 0}


class Bullet(Dynamics):
    """A fixed-base robot in its own DIRECT client; one state at a time."""

    def __init__(
        self, text: str, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: float
    ):
        with quiet():
            self._at = {'physicsClientId': pybullet.connect(pybullet.DIRECT)}
            weakref.finalize(self, pybullet.disconnect, **self._at)
            pybullet.setGravity(0, 0, -gravity, **self._at)
            pybullet.setPhysicsEngineParameter(**SOLVER, **COLD, **self._at)
            self._body = self._load(urdf.with_bodies(text, bodies))
        self._order(joints)
        self._pulled = [
            self._pull(j.child, bodies[j.child].force)
            for j in joints
            if any(bodies[j.child].force)
        ]
        self._h = 0.0
        self._mass: Any = None
        self._bias: Any = None

    def begin(self, q: Array, dq: Array, h: Any) -> None:
        if h != self._h:
            pybullet.setTimeStep(h, **self._at)
            self._h = h
        for joint, angle, rate in zip(self._joints, q.tolist(), dq.tolist(), strict=True):
            pybullet.resetJointState(self._body, joint, angle, rate, **self._at)

    def mass_and_bias(self, q: Array, dq: Array) -> tuple[Any, Any]:
        angles = q[self._to_bullet].tolist()
        mass = np.array(pybullet.calculateMassMatrix(self._body, angles, **self._at))
        if not self._in_order:
            mass = mass[self._mixed]
        self._mass, self._bias = mass, self._resistance(angles, dq)
        return mass, self._less_pulls(self._bias, angles)

    def bias(self, q: Array, dq: Array) -> Any:
        angles = q[self._to_bullet].tolist()
        return self._less_pulls(self._resistance(angles, dq), angles)

    def move(self, q: Array, dq: Array, faster: Array, h: Any) -> tuple[Any, Any]:
        """One step of the simulator under the torques that take the rates to `faster`."""
        torques = self._mass @ ((faster - dq) / h) + self._bias
        if self._pulled:
            torques = torques - self._pulls(q[self._to_bullet].tolist())
            self._apply()
        pybullet.setJointMotorControlArray(
            self._body, self._joints, pybullet.TORQUE_CONTROL, forces=torques.tolist(), **self._at
        )
        pybullet.stepSimulation(**self._at)
        states = pybullet.getJointStates(self._body, self._joints, **self._at)
        return np.array([s[0] for s in states]), np.array([s[1] for s in states])

    def _resistance(self, angles: list[float], dq: Array) -> Any:
        """Torques that keep the rates as they are without external forces, (J,)."""
        bias: Any = pybullet.calculateInverseDynamics(
            self._body, angles, dq[self._to_bullet].tolist(), self._still, **self._at
        )
        return np.array(bias)[self._from_bullet]

    def _less_pulls(self, bias: Any, angles: list[float]) -> Any:
        return bias - self._pulls(angles) if self._pulled else bias

    def _load(self, text: str) -> int:
        """Load a URDF text; PyBullet reads files only."""
        handle, path = tempfile.mkstemp(suffix='.urdf')
        try:
            with os.fdopen(handle, 'w', encoding='utf-8') as file:
                file.write(text)
            body: int = pybullet.loadURDF(
                path, useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE, **self._at
            )
        finally:
            os.unlink(path)
        return body

    def _order(self, joints: Sequence[Joint]) -> None:
        """Match PyBullet's joint numbers to ours; motors off, nothing damped."""
        numbers: dict[str, int] = {}
        self._links: dict[str, int] = {}
        for number in range(pybullet.getNumJoints(self._body, **self._at)):
            info = pybullet.getJointInfo(self._body, number, **self._at)
            numbers[info[1].decode()] = number
            self._links[info[12].decode()] = number
            free = {**UNDAMPED, 'jointDamping': 0, 'maxJointVelocity': 1e9}
            pybullet.changeDynamics(self._body, number, **free, **self._at)
        pybullet.changeDynamics(self._body, -1, **UNDAMPED, **self._at)
        self._joints = [numbers[j.name] for j in joints if j.kind != 'fixed']
        self._to_bullet = np.argsort(self._joints)
        self._from_bullet = np.argsort(self._to_bullet)
        self._mixed = np.ix_(self._from_bullet, self._from_bullet)
        self._in_order = self._joints == sorted(self._joints)
        self._still = [0.0] * len(self._joints)
        pybullet.setJointMotorControlArray(
            self._body, self._joints, pybullet.VELOCITY_CONTROL, forces=self._still, **self._at
        )

    def _pull(self, link: str, force: tuple[float, float, float]) -> tuple[int, Any, list[float]]:
        """A force at a link's CoM: link number, force, and CoM as calculateJacobian wants it.

        That is from the joint, in the axes of the inertial frame, whatever its manual says.
        """
        number = self._links[link]
        info = pybullet.getDynamicsInfo(self._body, number, **self._at)
        axes = np.array(pybullet.getMatrixFromQuaternion(info[4])).reshape(3, 3)
        return number, force, (axes.T @ info[3]).tolist()

    def _pulls(self, angles: list[float]) -> Any:
        """Torques of the external forces at the joints, (J,)."""
        total = np.zeros(len(angles))
        for number, force, lever in self._pulled:
            jacobian, _ = pybullet.calculateJacobian(
                self._body, number, lever, angles, self._still, self._still, **self._at
            )
            total += np.array(jacobian).T @ force
        return total[self._from_bullet]

    def _apply(self) -> None:
        for number, force, _ in self._pulled:
            place = pybullet.getLinkState(
                self._body, number, computeForwardKinematics=1, **self._at
            )[0]
            pybullet.applyExternalForce(
                self._body, number, force, place, pybullet.WORLD_FRAME, **self._at
            )
