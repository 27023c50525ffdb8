# SPDX-License-Identifier: Apache-2.0
"""Where the model fails: a heat map of joints and conditions, and the worst windows."""

from collections.abc import Sequence
from typing import Any

from bokeh.models import Range1d
import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.compare.where import against_motion, bin_in_words, Where, worst_places
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas, hover, LOW
from leo_diffmodel.report.page import models, Row, Section
from leo_diffmodel.report.text import numbered, percent, quantity, span, torque, unit
from leo_diffmodel.report.worst import Stretch
from leo_sim.model import Model

WORST = 6
MOST_JOINTS, LEAST_SHARE = 6, 0.005
WINDOWS = 3
MOST_EVENTS = 4
MOTION = ('phase', 'speed', 'direction', 'load', 'angle', 'position', 'turned')
ORDER = (*MOTION, 'input', 'motor', 'time')
MEASURED = 'measured', Stroke(palette.INK, 'points')
MODELS = Stroke(palette.BEFORE), palette.REPAIRED
BAND_SIGMAS = 2.0
MOST_DOTS = 100


def section(
    places: Where, model: Model, recordings: Recordings, worst: Sequence[Stretch] = ()
) -> Section:
    """The heat map, the worst conditions with their bag times, and the worst windows."""
    names = numbered(recordings)
    joints = sorted(places.joints, key=lambda r: -r['share'])
    shown = [j for j in joints[:MOST_JOINTS] if j['share'] >= LEAST_SHARE] or joints[:1]
    highest = max((_level(r) for r in places.rows), default=0.0)
    values = {
        'noise_only': places.noise_only,
        'joints': [_joint(j, places.rows, highest, names) for j in shown],
        'hidden': len(joints) - len(shown),
        'worst': [in_print(r, names) for r in worst_places(places.rows)[:WORST]],
        'against': [against(*found) for found in against_motion(places.rows)],
        'events': [_event(e, names) for e in places.events[:MOST_EVENTS]],
        'stretches': [title(s, model, recordings) for s in worst],
        'legend': [MEASURED, *models(*MODELS[: len(worst[0].predicted)])] if worst else [],
    }
    return Section('where.html', values, tuple(_figure(s, model) for s in worst))


def _joint(joint: Row, rows: Sequence[Row], highest: float, bags: list[str]) -> dict[str, Any]:
    mine = [r for r in rows if r['joint'] == joint['joint']]
    variables = [v for v in ORDER if any(r['variable'] == v for r in mine)]
    return {
        'name': joint['joint'],
        'share': percent(joint['share']),
        'size': _sizes(joint),
        'noise': torque(joint['noise_nm'], 2, joint['torque_unit']),
        'strips': [_strip(v, mine, highest, bags) for v in variables],
    }


def _strip(variable: str, rows: Sequence[Row], highest: float, bags: list[str]) -> dict[str, Any]:
    own = (r for r in rows if r['variable'] == variable)
    ordered = sorted(own, key=lambda r: (r['bag'] or 0, r['bin']))
    return {
        'name': variable,
        'unit': unit(ordered[0]['unit']),
        'span': _span(ordered),
        'cells': [
            {
                'share': f'{100 * r["share"]:.0f}\u00a0%',
                'shade': round(_level(r) / highest, 3) if highest else 0.0,
                'range': _range(r, bags),
                'tip': _tip(r, bags),
            }
            for r in ordered
        ],
    }


def _span(rows: Sequence[Row]) -> str:
    """The whole range of a variable, for screens too narrow to show each bin's."""
    ends = [end for r in rows if not isinstance(r['bin'], str) for end in r['bin']]
    return span(min(ends), max(ends)) if ends else ''


def _level(row: Row) -> float:
    """Missing torque in units of its noise: what a cell's colour stands for."""
    return float(row['torque_nm'] / row['noise_nm'])


def _range(row: Row, bags: list[str]) -> str:
    """A bin as in print, a stretch of time with its bag where there are several."""
    if isinstance(row['bin'], str):
        return row['bin']
    return f'{_bag(row, bags)} {span(*row["bin"])}'.strip()


def _bag(row: Row, bags: list[str]) -> str:
    return '' if row['bag'] is None else bags[row['bag']]


def _tip(row: Row, bags: list[str]) -> str:
    bag, words = _bag(row, bags), in_print(row, bags)
    where = f' of {bag}' if bag else ''
    return (
        f'{row["joint"]}, {row["variable"]} {bin_in_words(dict(row))}{where}: {_sizes(row)} '
        f'(noise {words["noise"]}), {words["share"]} of the error in '
        f'{words["time"]} of the time; worst at {words["windows"]}'
    )


def in_print(row: Row, bags: list[str]) -> dict[str, Any]:
    """A place of `leo_diffmodel.compare.where`, as the page shows it."""
    return {
        'joint': row['joint'],
        'variable': row['variable'],
        'range': f'{_range(row, bags)} {unit(row["unit"])}',
        'share': percent(row['share']),
        'time': percent(row['data_share']),
        'torque': torque(row['torque_nm'], of=row['torque_unit']),
        'noise': torque(row['noise_nm'], 2, row['torque_unit']),
        'volts': '–' if row['volts'] is None else quantity(row['volts'], 'V'),
        'stall': '–' if row['stall_percent'] is None else percent(row['stall_percent'] / 100),
        'windows': _times(row, bags),
    }


def _times(row: Row, bags: list[str]) -> str:
    """Bag times at which the worst windows begin, with the bag where there are several."""
    found = list(zip(row['windows'], row['bags'], strict=True))[:WINDOWS]
    return ', '.join(f'{bags[b]} {t0:.2f} s'.strip() for (t0, _), b in found)


def _sizes(row: Row) -> str:
    parts = [torque(row['torque_nm'], of=row['torque_unit'])]
    if row['volts'] is not None:
        parts.append(quantity(row['volts'], 'V'))
    if row['stall_percent'] is not None:
        parts.append(f'{percent(row["stall_percent"] / 100)} of stall')
    return ' = '.join(parts)


def against(joint: str, forward: float, backward: float, of: str) -> str:
    ahead, back = (torque(t, of=of) for t in (forward, backward))
    return f'{joint} lacks {ahead} moving forward and {back} moving backward (means)'


def _event(event: Row, bags: list[str]) -> str:
    when = f'{bags[event["bag"]]} {event["window"][0]:.2f} s'.strip()
    return f'{event["joint"]} {torque(event["torque_nm"], of=event["torque_unit"])} at {when}'


def title(stretch: Stretch, model: Model, recordings: Recordings) -> str:
    bag, joint = numbered(recordings)[stretch.bag], model.robot.joint_names[stretch.joint]
    return f'{bag} {stretch.time[0]:.2f} … {stretch.time[-1]:.2f} s, {joint}'.strip()


def _figure(stretch: Stretch, model: Model) -> Any:
    """A window as measured and as each model predicts it, and what noise in its start leaves open.

    The ordinate is that of the curves; the band about the last of them may reach beyond it.
    """
    name, time, last = model.robot.joint_names[stretch.joint], stretch.time, stretch.predicted[-1]
    plot = canvas('bag time [s]', f'{name} [{length_unit(model.robot, name)}]', height=LOW)
    band = BAND_SIGMAS * stretch.band
    plot.varea(time, last - band, last + band, color=palette.NOISE_FILL)
    few = slice(None, None, -(-len(time) // MOST_DOTS))
    look: dict[str, Any] = {'size': 4, 'color': palette.INK, 'line_color': None}
    dots = plot.scatter(time[few], stretch.measured[few], **look)
    hover(plot, dots, [('bag time', '@x{0.000} s'), ('measured', '@y{0.0000}')])
    for stroke, line in zip(MODELS, stretch.predicted, strict=False):
        plot.line(time, line, line_width=2.5, color=stroke.colour, line_dash=stroke.dash)
    ends = np.concatenate([stretch.measured, *stretch.predicted])
    margin = 0.08 * max(float(np.ptp(ends)), 1e-9)
    plot.y_range = Range1d(float(ends.min() - margin), float(ends.max() + margin))
    return plot
