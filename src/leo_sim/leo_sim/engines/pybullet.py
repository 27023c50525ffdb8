# SPDX-License-Identifier: Apache-2.0
"""PyBullet as the body of a model. The only module that imports pybullet.

Settings as leo_pybullet.md section 3 found them necessary for bit-identical steps. Stops,
damping and dry friction are laws of the model and switched off here.
"""
from collections.abc import Mapping, Sequence
import os
import tempfile
from typing import Any

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from leo_sim import urdf
from leo_sim.effects.base import Body
from leo_sim.urdf import Joint


class Bullet:
    """A fixed-base robot in its own DIRECT client; one state at a time."""

    def __init__(self, text: str, joints: Sequence[Joint], bodies: Mapping[str, Body],
                 gravity: float):
        self._client = BulletClient(connection_mode=pybullet.DIRECT)
        self._client.setGravity(0, 0, -gravity)
        self._client.setPhysicsEngineParameter(
            numSubSteps=0, numSolverIterations=10, deterministicOverlappingPairs=1,
            warmStartingFactor=0.0, solverResidualThreshold=0.0)
        self._body = self._load(urdf.with_bodies(text, bodies))
        self._order(joints)
        self._forces = [(self._links[j.child], bodies[j.child].force) for j in joints
                        if any(bodies[j.child].force)]
        self._h = 0.0
        self._mass: Any = None
        self._bias: Any = None

    def close(self) -> None:
        """Disconnect the client."""
        self._client.disconnect()

    def begin(self, q: Any, dq: Any, h: float) -> None:
        """Put the robot into a state; substeps of h s follow."""
        if h != self._h:
            self._client.setTimeStep(h)
            self._h = h
        for joint, angle, rate in zip(self._joints, q.tolist(), dq.tolist(), strict=True):
            self._client.resetJointState(self._body, joint, angle, rate)

    def mass_and_bias(self, q: Any, dq: Any) -> tuple[Any, Any]:
        """Joint-space inertia rows and bias torques, external forces included."""
        angles, rates = q[self._to_bullet].tolist(), dq[self._to_bullet].tolist()
        matrix = self._client.calculateMassMatrix(self._body, angles)
        bias = self._client.calculateInverseDynamics(self._body, angles, rates, self._still)
        if len(angles) > 1:
            matrix = np.array(matrix)[np.ix_(self._from_bullet, self._from_bullet)]
            bias = np.array(bias)[self._from_bullet]
        self._mass, self._bias = matrix, bias
        return matrix, [b - f for b, f in zip(bias, self._pulls(angles), strict=True)]

    def load(self, q: Any) -> Any:
        """Torque of gravity and external forces at the joints, (J,), along +q."""
        angles = q[self._to_bullet].tolist()
        still = self._client.calculateInverseDynamics(self._body, angles, self._still,
                                                      self._still)
        return np.array(self._pulls(angles)) - np.array(still)[self._from_bullet]

    def move(self, q: Any, dq: Any, faster: Any, h: float) -> tuple[Any, Any]:
        """One step of the simulator under the torques that take the rates to `faster`."""
        push = (faster - dq) / h
        pulls = self._pulls(q[self._to_bullet].tolist())
        torques = [float(sum(m * a for m, a in zip(row, push, strict=True))) + b - f
                   for row, b, f in zip(self._mass, self._bias, pulls, strict=True)]
        self._client.setJointMotorControlArray(
            self._body, self._joints, pybullet.TORQUE_CONTROL, forces=torques)
        self._pull()
        self._client.stepSimulation()
        states = self._client.getJointStates(self._body, self._joints)
        return np.array([s[0] for s in states]), np.array([s[1] for s in states])

    def _load(self, text: str) -> int:
        """Load a URDF text; PyBullet reads files only."""
        handle, path = tempfile.mkstemp(suffix='.urdf')
        try:
            with os.fdopen(handle, 'w', encoding='utf-8') as file:
                file.write(text)
            body: int = self._client.loadURDF(path, useFixedBase=True,
                                              flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
        finally:
            os.unlink(path)
        return body

    def _order(self, joints: Sequence[Joint]) -> None:
        """Match PyBullet's joint numbers to ours; motors off, nothing damped."""
        numbers, self._links = {}, {}
        for number in range(self._client.getNumJoints(self._body)):
            info = self._client.getJointInfo(self._body, number)
            numbers[info[1].decode()] = number
            self._links[info[12].decode()] = number
            self._client.changeDynamics(
                self._body, number, linearDamping=0, angularDamping=0, jointDamping=0,
                maxJointVelocity=1e9, collisionMargin=0)
        self._client.changeDynamics(self._body, -1, linearDamping=0, angularDamping=0)
        self._joints = [numbers[j.name] for j in joints if j.kind != 'fixed']
        self._to_bullet = np.argsort(self._joints)
        self._from_bullet = np.argsort(self._to_bullet)
        self._still = [0.0] * len(self._joints)
        self._client.setJointMotorControlArray(
            self._body, self._joints, pybullet.VELOCITY_CONTROL, forces=self._still)

    def _pulls(self, angles: list[float]) -> list[float]:
        """Torques of the external forces at the joints."""
        total = np.zeros(len(angles))
        for link, force in self._forces:
            jacobian, _ = self._client.calculateJacobian(
                self._body, link, [0, 0, 0], angles, self._still, self._still)
            total += np.array(jacobian).T @ force
        return total[self._from_bullet].tolist()

    def _pull(self) -> None:
        """Apply the external forces at the centres of mass for the next step."""
        for link, force in self._forces:
            place = self._client.getLinkState(self._body, link, computeForwardKinematics=1)[0]
            self._client.applyExternalForce(self._body, link, force, place,
                                            pybullet.WORLD_FRAME)
