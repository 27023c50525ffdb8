# SPDX-License-Identifier: Apache-2.0
"""Difference models from a simulated robot's bags, without the graph."""

from __future__ import annotations

from dataclasses import asdict, replace
import json
from pathlib import Path
from typing import Any

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.difference.data import transitions
from leo_diffmodel.difference.fit import fit
from leo_diffmodel.difference.job import repaired
from leo_diffmodel.difference.network import CONFIGS
from leo_learner.environment.rollouts import Rollouts
from leo_msgs_py.whole_file import write_whole
from leo_sim.model import Model


class Bags:
    """Fits difference models to everything the robot has done, as the node does.

    Args:
        folder: of the bags and the fits.
        robot: which keeps what it does.
        config: of the difference model.
        names: whether effects are named first.
    """

    def __init__(self, folder: Path, robot: Rollouts, config: str, names: bool) -> None:
        self._folder, self._robot = folder, robot
        self._config, self._names = CONFIGS[config], names

    def newer(self, version: int) -> bytes:
        """Weights of version + 1."""
        bag = self.bag(version)
        if not bag.exists():
            self._robot.write(bag)
        ideal = Model('leo')
        recordings, base = self.recordings(), ''
        model = ideal
        if self._names:
            path = self._folder / f'named-{version + 1:03d}.yaml'
            path.unlink(missing_ok=True)
            model, base = repaired(recordings, ideal, path)
        steps = transitions(recordings, model)
        difference, report = fit(steps, model, self._config, base=base, seed=version)
        write_whole(self._report(version + 1), json.dumps(asdict(report)))
        return replace(difference, version=version + 1).to_bytes()

    def bag(self, version: int) -> Path:
        """Where what the robot did before the update of a version is written, as it is fitted."""
        return self._folder / f'rollout-{version}'

    def recordings(self) -> list[Recording]:
        """What the robot has done, in time order."""
        return [
            read_bag(bag, self._robot.model_env.robot)
            for bag in sorted(self._folder.glob('rollout-*'))
        ]

    def reports(self) -> list[dict[str, Any]]:
        """What each fit was worth on its held-out part."""
        paths = sorted(self._folder.glob('fit-*.json'))
        return [json.loads(path.read_text()) for path in paths]

    def _report(self, version: int) -> Path:
        return self._folder / f'fit-{version:03d}.json'
