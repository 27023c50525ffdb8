# SPDX-License-Identifier: Apache-2.0
"""Write docs/faults.md and its pictures from the catalogue of faults of a log.

python docs/make_faults.py            writes them
python docs/make_faults.py --check    exit status 1 where they are not up to date
"""

from collections.abc import Iterator
import math
import sys

from make_effects import Curve, picture, written
import numpy as np

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.catalogue import Fault, FAULTS
from leo_diffmodel.faults.found import Found
from leo_diffmodel.outside.finding import ERROR
from leo_lab.blind.spoil import spoil

SHOWN = {
    'speed_scale': 1.6,
    'speed_sign': -1.0,
    'speed_wraps': 8.0,
    'speed_sign_bit': 4.0,
    'speed_zero': 1.5,
    'speed_late': 0.25,
    'speed_filter': 0.3,
    'angle_scale': 1.6,
    'angle_sign': -1.0,
    'angle_zero': 0.8,
    'goal_as_angle': 1.0,
    'goal_exchanged': -0.1,
    'frozen': 0.5,
    'clipped': 2.0,
    'repeated': 0.6,
    'quantised': 0.4,
    'input_scale': 1.6,
    'input_sign': -1.0,
    'input_exchanged': 1.0,
    'input_dead': 0.5,
    'input_late': 0.25,
    'gravity_compensated': 1.0,
    'time_stretch': 1.3,
}
"""Sizes that show on these axes."""
TIME = np.arange(0, 4, 0.04)
ANGLE = np.sin(3 * TIME) * np.exp(-0.2 * TIME)
COLUMN = {'angle': 'q', 'speed': 'dq', 'input': 'inputs', 'time': 'q'}
LABEL = {'angle': 'angle', 'speed': 'speed', 'input': 'input', 'time': 'angle'}
HEAD = """# The faults of a log

What can be wrong with a log before anything is wrong with the robot, as the catalogue has it
(`src/leo_diffmodel/leo_diffmodel/faults/catalogue.yaml`). Written by
`python docs/make_faults.py`; a test holds it to the catalogue. Blue: as logged, dashed: as it
was, over time.

`leo check` names them with size and interval, `leo explain` begins with them: a fault whose
interval excludes every harmless size is the answer, with the line of the topic map that mends it.
`leo explain --mend` undoes such faults in memory and goes on; `leo bag fix BAG -o NEW` writes the
mended bag. A fault that a good log may have as well is a warning, and so is a scale of less than
two that another log of the same joint has not: where feet rattle, sampled speeds are not the mean
ones.

How they are found: sensors first, one by one. Then angle and speed of each joint, without any
model: one smooth motion must agree with both, and the speed must add up to the angle better once
the fault is undone. Where the two contradict each other by a factor or a sign, and for everything
about inputs, zeros and time, the balance of torques suggests: which share of the model's gravity
and of its motor moves the joint. Besides the interval of such a figure, its worst case counts:
what it would be off by if all that the model leaves unexplained were of its kind.

What the balance of one joint suggests is an error only where it is needed. The log with the fault
and the log as it is both predict the logged input from the motion, each with friction of every
kind, payloads, masses, rotors, springs, tilts and delays at every joint, in blocks of time that
neither was fitted to. A fault that does not predict them better is not told; one that does so by
less than two standard errors is a warning, and `leo explain` goes on with a note. From two to ten
it is an error of `leo check`, and `leo explain` hears it beside all effects: it searches the log
as it is and the log without the fault, and the fault stands where that predicts held-out motion
surely better; else it is a note. Beyond ten no effect can do instead. The input is
what is predicted and never what others are predicted from: a factor of a noisy column comes out
too small, the more so where friction takes most of the torque.

Faults that the reader mends or names by itself are not here: wraps by whole turns, goals wrapped
apart from their angle, spikes of a speed once a turn, values that nobody measured (0 or subnormal
while the joint moves), a second publisher, differences logged as speeds ([your_robot.md](
your_robot.md)).
"""


def example() -> Episode:
    """A swing that dies out, the square wave that drives it, and that of another joint."""
    drive = np.sign(np.cos(3 * TIME + np.array([[0.4], [2.0]]))).T
    return Episode(
        TIME,
        ANGLE[:, None],
        np.gradient(ANGLE, TIME)[:, None],
        drive,
        np.ones(drive.shape, dtype=bool),
    )


def curve(fault: Fault) -> Curve:
    """The channel that a fault is of, as it was and as logged."""
    clean, column = example(), COLUMN[fault.channel]
    if fault.name == 'gravity_compensated':
        logged = clean.inputs - np.sin(clean.q)
        return 'time', 'input', TIME, clean.inputs[:, 0], logged[:, 0]
    spoilt = spoil(fault.name, clean, 0, 0, SHOWN[fault.name])
    after = np.interp(TIME, spoilt.t, getattr(spoilt, column)[:, 0])
    return 'time', LABEL[fault.channel], TIME, getattr(clean, column)[:, 0], after


def page() -> str:
    """The whole of faults.md."""
    return '\n'.join([HEAD, *(line for fault in FAULTS.values() for line in _entry(fault))])


def _entry(fault: Fault) -> Iterator[str]:
    yield f'## {fault.name}\n'
    yield f'![{fault.name}](faults/{fault.name}.svg)\n'
    yield f'`{fault.law}`\n'
    yield f'{fault.what}\n'
    yield '| | |\n|---|---|'
    yield f'| channel | {fault.channel}{" of all joints" if fault.whole_log else ""} |'
    yield f'| harmless | {_harmless(fault)} |'
    yield f'| looks like | {fault.looks_like} |'
    yield f'| can be confused with | {fault.confused_with} |'
    yield f'| if it is not seen | {fault.costs} |'
    yield f'| mended by | {_mend(fault)} |\n'


def _harmless(fault: Fault) -> str:
    low, high = fault.harmless
    unit = f' {fault.unit}' if fault.unit else ''
    if fault.harmless_words:
        return fault.harmless_words
    if math.isinf(high):
        return 'never'
    return 'none' if low == high else f'{low:.3g} to {high:.3g}{unit}'


def _mend(fault: Fault) -> str:
    """The line of the topic map, for the size that is shown."""
    names = ('elbow', 'wrist', 'wrist', 'elbow') if fault.name == 'input_exchanged' else ()
    joint, value = '' if fault.whole_log else 'elbow', SHOWN[fault.name]
    known = {'joint': joint, 'names': names, 'evidence': ''}
    line = Found(fault.name, ERROR, '', value=value, **known).line
    return f'`{line}` in the topic map' if line else fault.todo


def main(argv: list[str]) -> int:
    """Write all files, or tell whether they are as they would be written."""
    pictures = {f'faults/{name}.svg': picture(*curve(f)) for name, f in FAULTS.items()}
    return written({'faults.md': page(), **pictures}, 'faults', argv)


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
