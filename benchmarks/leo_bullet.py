# SPDX-License-Identifier: Apache-2.0
"""LEO stepped by Bullet itself, its soft contacts included, beside our contact law.

    python benchmarks/leo_bullet.py [--states 100]

Bullet integrates explicitly, at 0.03 ms and less, with the motors' torques sent every step and
contacts through its own collision detection and solver (docs/reference/bullet.md, 1 to 3).
"""

import argparse
import os
import tempfile
from xml.etree import ElementTree

from leo_states import moved, sampled, States
import numpy as np
import pybullet

from leo_sim.description import urdf
from leo_sim.model import Model

PERIOD = 0.03  # s
FAR = 50.0  # m


class OwnBullet:
    """LEO with the collision spheres of robot.yaml on Bullet's plane."""

    def __init__(self, model: Model, h: float):
        self._model, self._h = model, h
        self._at = {'physicsClientId': pybullet.connect(pybullet.DIRECT)}
        pybullet.setGravity(0, 0, -9.81, **self._at)
        pybullet.setTimeStep(h, **self._at)
        pybullet.setPhysicsEngineParameter(
            numSubSteps=0,
            numSolverIterations=50,
            deterministicOverlappingPairs=1,
            warmStartingFactor=0.0,
            solverResidualThreshold=0.0,
            **self._at,
        )
        shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, **self._at)
        plane = pybullet.createMultiBody(0, shape, **self._at)
        pybullet.changeDynamics(plane, -1, lateralFriction=1.0, **self._at)
        self._body = self._load(_with_spheres(model))
        self._prepare()

    def step(self, q: np.ndarray, dq: np.ndarray, volts: np.ndarray) -> tuple[list, list]:
        """Angles and rates after one control period."""
        self._put(q + [0, FAR, 0, 0, 0, 0, 0, 0, 0], dq)
        pybullet.performCollisionDetection(**self._at)
        self._put(q, dq)
        motor = self._model.robot.actuators[0]
        gain = motor.torque_constant / motor.resistance
        for _ in range(round(PERIOD / self._h)):
            states = pybullet.getJointStates(self._body, self._joints[3:], **self._at)
            torques = [
                gain * (u - motor.torque_constant * s[1])
                for u, s in zip(volts, states, strict=True)
            ]
            pybullet.setJointMotorControlArray(
                self._body, self._joints[3:], pybullet.TORQUE_CONTROL, forces=torques, **self._at
            )
            pybullet.stepSimulation(**self._at)
        states = pybullet.getJointStates(self._body, self._joints, **self._at)
        return [s[0] for s in states], [s[1] for s in states]

    def _put(self, q: np.ndarray, dq: np.ndarray) -> None:
        for joint, angle, rate in zip(self._joints, q, dq, strict=True):
            pybullet.resetJointState(self._body, joint, angle, rate, **self._at)

    def _load(self, text: str) -> int:
        handle, path = tempfile.mkstemp(suffix='.urdf')
        with os.fdopen(handle, 'w', encoding='utf-8') as file:
            file.write(text)
        body: int = pybullet.loadURDF(
            path, useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE, **self._at
        )
        os.unlink(path)
        return body

    def _prepare(self) -> None:
        """Motors off, nothing damped, soft feet."""
        numbers = {}
        ground = self._model.laws.ground
        for number in range(pybullet.getNumJoints(self._body, **self._at)):
            name = pybullet.getJointInfo(self._body, number, **self._at)[1].decode()
            numbers[name] = number
            # In one call Bullet takes the first and leaves the rest out.
            pybullet.changeDynamics(
                self._body, number, linearDamping=0, angularDamping=0, **self._at
            )
            pybullet.changeDynamics(self._body, number, maxJointVelocity=1e9, **self._at)
            pybullet.changeDynamics(
                self._body,
                number,
                lateralFriction=ground.friction,
                restitution=0,
                contactStiffness=ground.stiffness,
                contactDamping=ground.damping,
                **self._at,
            )
        self._joints = [numbers[name] for name in self._model.robot.joint_names]
        pybullet.setJointMotorControlArray(
            self._body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            forces=[0.0] * len(self._joints),
            **self._at,
        )


def _with_spheres(model: Model) -> str:
    """The URDF without stops, with the feet's collision spheres."""
    root = ElementTree.fromstring(urdf.with_bodies(model.robot.urdf, model.laws.bodies))
    links = {link.get('name'): link for link in root.findall('link')}
    for contact in model.robot.contacts[:4]:
        collision = ElementTree.SubElement(links[contact.link], 'collision')
        ElementTree.SubElement(collision, 'origin', xyz=f'{contact.x} 0 {contact.z}')
        geometry = ElementTree.SubElement(collision, 'geometry')
        ElementTree.SubElement(geometry, 'sphere', radius=str(contact.radius))
    return ElementTree.tostring(root, encoding='unicode')


def clear_of_stops(model: Model, states: States) -> States:
    """The states from which no joint comes near a stop within a control step."""
    low, high = model.laws.stops
    margin, there = 0.02, np.ones(len(states.q), dtype=bool)
    for part in np.linspace(0, PERIOD, 6)[1:]:
        q, _ = moved(model, states, part)
        there &= ((q > low + margin) & (q < high - margin)).all(axis=-1)
    return States(*(a[there] for a in states))


def main() -> None:
    """Print the differences of one control step over its change."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n', maxsplit=1)[0])
    parser.add_argument('--states', type=int, default=100)
    count = parser.parse_args().states
    model = Model('leo', engine='rigid', integration_step=1e-5)
    found = sampled(Model('leo', engine='rigid', scheme='training'), 8 * count, seed=3)
    print(
        'Bullet with its own contacts against ours (0.01 ms): rms difference of one control '
        'step over rms change, % (median of the states in brackets)'
    )
    for kind, states in found.items():
        given = States(*(a[:count] for a in clear_of_stops(model, states)))
        ours = moved(model, given, PERIOD)
        for h in (3e-5, 1e-5):
            bullet = OwnBullet(model, h)
            theirs = np.array([bullet.step(*one) for one in zip(*given, strict=True)])
            print(
                f'{kind:11} n {len(given.q):4} Bullet at {h * 1e3:g} ms: '
                + ', '.join(
                    _line(name, theirs[:, i] - ours[i], ours[i] - given[i])
                    for i, name in enumerate(('angles', 'rates'))
                )
            )


def _line(name: str, error: np.ndarray, change: np.ndarray) -> str:
    each, moves = (np.sqrt(np.mean(a[:, 2:] ** 2, axis=-1)) for a in (error, change))
    scale = np.sqrt(np.mean(moves**2))
    return (
        f'{name} {100 * np.sqrt(np.mean(each**2)) / scale:.2f} '
        f'({100 * np.median(each) / scale:.2f})'
    )


if __name__ == '__main__':
    main()
