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
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.film import RATE
from leo_diffmodel.picture.solid_page import Moving, solid_page
from leo_diffmodel.picture.take import Take, take
from leo_diffmodel.watch.film import Film
from leo_diffmodel.watch.state import HORIZON
from leo_msgs_py.whole_file import write_whole
from leo_sim.model import Model

MOST = 1500  # poses; a longer part is shown at fewer a second


def show_solid(
    bag: Path,
    output: Path,
    models: Mapping[str, Model],
    topic_map: str | None = None,
    at: float | None = None,
    seconds: float | None = None,
) -> Path:
    """Write a page of a part, as `leo bag show` chooses it, with what models by name predict.

    The first is as given, a second repaired. UserError: something cannot be read, predicted or
    shown, or the models are of two robots.
    """
    same_robot(models)
    robot = next(iter(models.values())).robot
    recording = read_bag(bag, robot, topic_map)
    shown = take(recording, robot, at, seconds)
    part = replace(recording, episodes=(shown.episode,))
    given, *others = (with_known(model, [part]) for model in models.values())
    with enough([part], f'{2 * HORIZON:g} s or more'):
        film = Film.over([part], HORIZON, given, *(others or [given]))
    times = _times(film, shown)
    poses = np.array([film.frame(float(t)) for t in times])
    begin = times[0] + shown.episode.t[0]
    title = f'{shown.title}, from {begin:.2f} s; {ahead(HORIZON)}'
    moving = robots(poses, 'repaired')[: 1 + len(models)]
    return write_whole(output, solid_page(title, robot, times - times[0], moving))


def _times(film: Film, shown: Take) -> Array:
    """When poses are shown, of what the film has of it [s since the begin of the episode]."""
    part = np.array([shown.start, shown.end]) - shown.episode.t[0]
    begin, end = np.clip(part, film.time[0, 0], film.time[-1, -1])
    return np.linspace(begin, end, min(MOST, 1 + round(RATE * (end - begin))))


def robots(poses: Array, repaired: str) -> list[Moving]:
    """As measured, as given and repaired, by angles as given, repaired and measured, (F, 3, J)."""
    given, better, measured = np.moveaxis(poses, 1, 0)
    before, after = palette.GIVEN.colour, palette.REPAIRED.colour
    return [
        Moving('measured', measured),
        Moving('as given', given, before),
        Moving(repaired, better, after),
    ]


def ahead(seconds: float) -> str:
    return f'predicted {seconds:.2g} s ahead, again and again'
