# SPDX-License-Identifier: Apache-2.0
"""The robot of a bag and what its models predict, on top of each other in three dimensions."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.compare.comparison import enough
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.ranking import same_robot
from leo_diffmodel.picture.film import RATE
from leo_diffmodel.picture.solid_page import solid_page
from leo_diffmodel.picture.take import take
from leo_diffmodel.watch.film import Film
from leo_diffmodel.watch.state import HORIZON
from leo_msgs_py.whole_file import write_whole
from leo_sim.model import Model

MOST = 1500  # poses; of a longer part fewer a second are shown
MEASURED_FIRST = [2, 0, 1]
"""Of angles as given, repaired and as measured."""
LABELS = 'measured', 'as given', 'repaired'


def show_solid(
    bag: Path, output: Path, models: Mapping[str, Model], mapping: str | None, *part: float | None
) -> Path:
    """Write a page of a part, as of `take`, with a topic map: a model as given, and one repaired.

    UserError: something cannot be read, predicted or shown, or the models are of two robots.
    """
    same_robot(models)
    robot = next(iter(models.values())).robot
    recording = read_bag(bag, robot, mapping)
    shown = take(recording, robot, *part)
    episode, first = [replace(recording, episodes=(shown.episode,))], float(shown.episode.t[0])
    with enough(episode, f'{2 * HORIZON:g} s or more'):
        known = [with_known(model, episode) for model in models.values()]
        film = Film.of(episode, HORIZON, known[0]).repaired_by(known[-1])
    ends = np.array([shown.start, shown.end]) - first
    begin, end = np.clip(ends, film.time[0, 0], film.time[-1, -1])
    times = np.linspace(begin, end, min(MOST, 1 + round(RATE * (end - begin))))
    poses = np.array([film.frame(float(t)) for t in times])[:, MEASURED_FIRST]
    title = f'{shown.title}, from {first + begin:.2f} s; {ahead(HORIZON)}'
    count = 1 + len(models)
    return write_whole(output, solid_page(title, robot, times, poses[:, :count], LABELS[:count]))


def ahead(seconds: float) -> str:
    return f'predicted {seconds:.2g} s ahead, again and again'
