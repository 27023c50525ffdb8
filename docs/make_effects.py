# SPDX-License-Identifier: Apache-2.0
"""Write docs/effects.md and its pictures from the catalogue of effects.

python docs/make_effects.py            writes them
python docs/make_effects.py --check    exit status 1 where they are not up to date
"""

from collections.abc import Callable, Iterator
from pathlib import Path
import sys
from typing import Any

import numpy as np

from leo_sim.description.urdf import Body
from leo_sim.effects import Effect, EFFECTS, Parameter
from leo_sim.effects.base import Drive, Ground, Loop
from leo_sim.effects.motor import Motor, sagging

DOCS = Path(__file__).parent
SHOWN: dict[str, dict[str, float]] = {
    'command_delay': {'delay': 0.1},
    'voltage_scale': {'k': 0.6},
    'voltage_deadband': {'v': 0.3},
    'voltage_limit': {'v': 0.6},
    'voltage_push': {'v': 0.3},
    'actuator_lag': {'tau': 0.1},
    'torque_scale': {'k': 0.6},
    'back_emf_scale': {'k': 1.5},
    'viscous_friction': {'b': 0.6},
    'coulomb_friction': {'c': 0.5},
    'stribeck_friction': {'c': 0.3, 'c_static': 0.7, 'v_s': 0.3},
    'load_dependent_friction': {'mu': 0.5},
    'stribeck_load_friction': {'mu': 0.3, 'mu_static': 0.7, 'v_s': 0.3},
    'quadratic_load_friction': {'mu': 0.1, 'mu2': 0.6},
    'directional_load_friction': {'mu': 0.3, 'mu_back': 0.6},
    'quadratic_drag': {'d': 0.7},
    'bias_torque': {'t': 0.4},
    'joint_spring': {'k': 0.25, 'rest': 0.5},
    'backlash': {'gap': 0.6},
    'armature': {'J': 1.0},
    'torque_ripple': {'a': 0.5, 'n': 4.0, 'phase': 0.0},
    'link_mass': {'m': 0.6},
    'link_com': {'x': 0.3, 'z': -0.2},
    'link_inertia': {'I': 1.0},
    'payload': {'m': 0.6, 'x': 0.5, 'z': -1.0},
    'late_payload': {'m': 0.6, 'x': 0.5, 'z': -1.0},
    'servo_stiffness': {'k': 1.6},
    'servo_damping': {'d': 0.8},
    'goal_rate': {'rate': 4.0},
    'goal_acceleration': {'a': 15.0},
    'external_force': {'x': 3.0, 'z': 0.0},
    'gravity': {'x': 3.0, 'z': 0.0},
    'warming_friction': {'c': 0.3, 'c_start': 0.8, 'T': 0.15},
    'torque_fade': {'s': 0.5, 'T': 0.2},
    'smooth_friction': {'c': 0.5, 'v_0': 0.2},
    'supply_sag': {'R': 0.6},
    'ground_friction': {'mu': 0.5},
    'ground_compliance': {'k': 0.5, 'd': 0.0},
    'ground_slope': {'angle': 0.3},
    'encoder_offset': {'o': 0.4},
    'encoder_scale': {'k': 1.3},
    'encoder_eccentricity': {'a': 0.3, 'b': 0.3},
    'velocity_lag': {'tau': 0.1},
    'measurement_delay': {'delay': 0.1},
}
"""Values that show the law on axes of about -1 to 1."""
SIGNED, TURN = np.linspace(-1, 1, 81), np.linspace(-np.pi, np.pi, 121)
TIME = np.arange(0, 0.6, 0.01)
LINK = Body(1.0, (0.0, 0.0, -1.0), (1.0,) * 3 + (0.0,) * 3)
FLOOR = Ground(1.0, 0.0, 1.0, 0.0)
LOOP = Loop(1.6, 0.0, 0.0, 1.0, np.inf, 1.0)
Curve = tuple[str, str, np.ndarray, np.ndarray, np.ndarray]
"""Names of the axes, x, y without the effect, y with it."""


def by_rate(effect: Effect, p: dict[str, float]) -> Curve:
    """Torque over rate; the motor is held at 0 V, and its back-EMF torque is -w."""
    motor = Motor(-SIGNED, -SIGNED)
    base = -SIGNED if effect.motor_side else 0 * SIGNED
    return 'rate', 'torque', SIGNED, base, base + effect.torque(p, 0 * SIGNED, SIGNED, motor, 0.0)


def by_angle(effect: Effect, p: dict[str, float]) -> Curve:
    """Torque over angle, a whole turn."""
    torque = effect.torque(p, TURN, 0 * TURN, Motor(0.0, 0.0), 0.0)
    return 'angle', 'torque', TURN, 0 * TURN, torque


def by_motor_torque(effect: Effect, p: dict[str, float]) -> Curve:
    """Torque of the motor as it reaches the joint."""
    changed = effect.torque(p, 0 * SIGNED, 0 * SIGNED, Motor(SIGNED, 0 * SIGNED), 0.0)
    return 'torque of the motor', 'at the joint', SIGNED, SIGNED, SIGNED + changed


def by_load(effect: Effect, p: dict[str, float]) -> Curve:
    """Friction moving forward, over the torque that the motor holds against a load."""
    still = 0 * SIGNED
    torque = effect.torque(p, still, still + 1, Motor(still, still), SIGNED)
    return 'motor torque less load', 'friction, forward', SIGNED, still, torque


def by_load_and_rate(effect: Effect, p: dict[str, float]) -> Curve:
    """Friction over rate, of a gear that carries 1 N m."""
    still = 0 * SIGNED
    torque = effect.torque(p, still, SIGNED, Motor(still, still), still + 1)
    return 'rate', 'friction under load', SIGNED, still, torque


def by_power(effect: Effect, p: dict[str, float]) -> Curve:
    """Friction moving forward, over the torque of a motor that drives or brakes."""
    still = 0 * SIGNED
    torque = effect.torque(p, still, still + 1, Motor(SIGNED, still), still)
    return 'torque of the motor', 'friction, forward', SIGNED, still, torque


def by_command(effect: Effect, p: dict[str, float]) -> Curve:
    """What reaches the motor over what was commanded."""
    return 'command', 'at the motor', SIGNED, SIGNED, effect.command(p, SIGNED, None, 0.01)[0]


def after_a_step(effect: Effect, p: dict[str, float]) -> Curve:
    """What reaches the motor, or is measured, after a step at 0.1 s."""
    given = np.where(TIME > 0.095, 1.0, 0.0)
    memory, seen = None, []
    for u in given:
        if effect.hook != 'sensor':
            late, memory = effect.command(p, np.array([u]), memory, 0.01)
        else:
            each = np.array([u])
            _, late, memory = effect.sensor(p, each, each, memory, 0.01)
        seen.append(float(late[0]))
    label = {'command': 'at the motor', 'servo': 'goal'}.get(effect.hook, 'measured rate')
    return 'time', label, TIME, given, np.array(seen)


def over_time(effect: Effect, p: dict[str, float]) -> Curve:
    """What reaches a joint that moves forward of a motor that gives 1 N m."""
    still = 0 * TIME
    changed = effect.torque(p, still, still + 1, Motor(still + 1, still), 0.0, TIME)  # type: ignore
    return 'time', 'at the joint', TIME, still + 1, 1 + changed


def duty(effect: Effect, p: dict[str, float]) -> Curve:
    """What a servo gives over its error at rest, or over its rate at the goal."""
    loop, gain = effect.servo(p, LOOP), effect.name == 'servo_stiffness'
    slopes = (LOOP.gain, loop.gain) if gain else (-LOOP.rate_gain, -loop.rate_gain)
    curves = (np.clip(slope * SIGNED, -1.0, 1.0) for slope in slopes)
    return 'error' if gain else 'rate', 'duty', SIGNED, *curves


def by_true_angle(effect: Effect, p: dict[str, float]) -> Curve:
    """What the encoder reads over the true angle."""
    read = effect.sensor(p, SIGNED, 0 * SIGNED, None, 0.01)[0]
    return 'true angle', 'measured', SIGNED, SIGNED, read


def weight(effect: Effect, p: dict[str, float]) -> Curve:
    """Torque that holds a link of 1 kg, 1 m below its hinge, at an angle; gravity is 9.81."""
    return 'angle', 'torque to hold it', TURN, _held(LINK), _held(effect.body(p, LINK))


def acceleration(effect: Effect, p: dict[str, float]) -> Curve:
    """Acceleration over torque, of a link of 1 kg m2 about its hinge."""
    if effect.hook == 'drive':
        added = effect.drive(p, Drive(0.0, 0.0)).rotor_inertia
    else:
        added = effect.body(p, LINK).inertia[1] - LINK.inertia[1]
    return 'torque', 'acceleration', SIGNED, SIGNED, SIGNED / (1.0 + added)


def play(effect: Effect, p: dict[str, float]) -> Curve:
    """Torque that a stiff gear carries over the twist between motor and link."""
    half = effect.drive(p, Drive(0.0, 0.0)).gap / 2
    carried = np.sign(SIGNED) * np.maximum(np.abs(SIGNED) - half, 0.0)
    return 'motor less link angle', 'torque', SIGNED, SIGNED, carried


def sag(effect: Effect, p: dict[str, float]) -> Curve:
    """What reaches a motor of 1 ohm at rest, alone behind a supply of 1 V."""
    motors, source = (1.0, 1.0, 1.0, None), effect.drive(p, Drive(0.0, 0.0)).source
    left = sagging(SIGNED[:, None], np.zeros((1, 1)), motors, source)[:, 0]
    return 'command', 'at the motor', SIGNED, SIGNED, left * SIGNED


def grip(effect: Effect, p: dict[str, float]) -> Curve:
    """Largest force along the ground over the force onto it."""
    load = np.linspace(0, 1, 11)
    return 'force onto it', 'grip', load, load, effect.ground(p, FLOOR).friction * load


def press(effect: Effect, p: dict[str, float]) -> Curve:
    """Force of the ground over the depth of a foot in it."""
    depth = np.linspace(-0.5, 1, 61)
    inside = np.maximum(depth, 0.0)
    return 'depth', 'force', depth, inside, effect.ground(p, FLOOR).stiffness * inside


def height(effect: Effect, p: dict[str, float]) -> Curve:
    """Height of the ground over the distance."""
    slope = np.tan(effect.ground(p, FLOOR).slope)
    return 'distance', 'height', SIGNED, 0 * SIGNED, slope * SIGNED


CURVES: dict[str, Callable[[Effect, dict[str, float]], Curve]] = {
    'torque_scale': by_motor_torque,
    'load_dependent_friction': by_load,
    'quadratic_load_friction': by_load,
    'stribeck_load_friction': by_load_and_rate,
    'directional_load_friction': by_power,
    'bias_torque': by_angle,
    'joint_spring': by_angle,
    'torque_ripple': by_angle,
    'link_mass': weight,
    'link_com': weight,
    'payload': weight,
    'late_payload': weight,
    'external_force': weight,
    'gravity': weight,
    'link_inertia': acceleration,
    'armature': acceleration,
    'backlash': play,
    'supply_sag': sag,
    'servo_stiffness': duty,
    'servo_damping': duty,
    'ground_friction': grip,
    'ground_compliance': press,
    'ground_slope': height,
}


def curve(effect: Effect) -> Curve:
    """What is drawn of an effect."""
    if effect.name in CURVES:
        draw = CURVES[effect.name]
    elif effect.hook == 'torque':
        draw = over_time if effect.timed else by_rate
    elif effect.dynamic:
        draw = after_a_step
    else:
        draw = by_command if effect.hook == 'command' else by_true_angle
    return draw(effect, SHOWN[effect.name])


def _held(link: Body) -> np.ndarray:
    """Torque against weight and constant force at the hinge, link hanging at angle 0."""
    x, _, z = link.com
    along = x * np.cos(TURN) - z * np.sin(TURN)
    up = x * np.sin(TURN) + z * np.cos(TURN)
    fx, _, fz = link.force
    torque: np.ndarray = along * (9.81 * link.mass - fz) + up * fx
    return torque


WIDTH, HEIGHT, EDGE = 240, 140, 22


def picture(across: str, up: str, x: np.ndarray, without: np.ndarray, with_it: np.ndarray) -> str:
    """A small SVG of a curve: dashed without, blue with what is shown."""
    both = np.concatenate([without, with_it, [0.0]])
    low, high = both.min(), both.max()
    room = 0.08 * (high - low)
    px = EDGE + (WIDTH - 2 * EDGE) * (x - x[0]) / (x[-1] - x[0])

    def py(y: Any) -> Any:
        return HEIGHT - EDGE - (HEIGHT - 2 * EDGE) * (y - low + room) / (high - low + 2 * room)

    zero = float(py(0.0))
    return '\n'.join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
            f'width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif" font-size="10">',
            f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>',
            f'<path d="M{EDGE} {zero:.1f}H{WIDTH - EDGE}" stroke="#bbb"/>',
            *(
                [f'<path d="M{WIDTH / 2:.0f} {EDGE}V{HEIGHT - EDGE}" stroke="#bbb"/>']
                if x[0] == -x[-1]
                else []
            ),
            _line(px, py(without), '#888', ' stroke-dasharray="4 3"'),
            _line(px, py(with_it), '#1f6fb4', ' stroke-width="2"'),
            f'<text x="{WIDTH - EDGE}" y="{HEIGHT - 7}" text-anchor="end" fill="#555">'
            f'{across}</text>',
            f'<text x="{EDGE}" y="14" fill="#555">{up}</text>',
            '</svg>\n',
        ]
    )


def _line(x: np.ndarray, y: np.ndarray, colour: str, more: str) -> str:
    points = ' '.join(f'{a:.1f},{b:.1f}' for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" fill="none" stroke="{colour}"{more}/>'


HEAD = """# The effects

Every law that `leo explain` tries, as the catalogue has it (`src/leo_sim/leo_sim/effects`, one
class each). Written by `python docs/make_effects.py`; a test holds it to the catalogue. Blue: with
the effect, dashed: without; axes in arbitrary units. q is an angle, w a rate, u the input, tau a
torque at the joint, t the time since a run began. `V` is `N m` on robots that take torques. What
one acts on is its hook: [your_effect.md](your_effect.md) says what each gets and gives, and how to
write one of your own.
"""


def page() -> str:
    """The whole of effects.md."""
    families: dict[str, list[Effect]] = {}
    for effect in EFFECTS.values():
        families.setdefault(effect.family, []).append(effect)
    parts = [HEAD, *(line for f, effects in families.items() for line in _family(f, effects))]
    return '\n'.join(parts)


def _family(family: str, effects: list[Effect]) -> Iterator[str]:
    yield f'## {family[0].upper()}{family[1:]}\n'
    for effect in effects:
        yield from _entry(effect)


def _entry(effect: Effect) -> Iterator[str]:
    yield f'### {effect.name}\n'
    yield f'![{effect.name}](effects/{effect.name}.svg)\n'
    yield f'`{effect.equation}`\n'
    yield f'{(type(effect).__doc__ or "").strip().splitlines()[0]}\n'
    yield '| | |\n|---|---|'
    parameters = '; '.join(_parameter(effect, p) for p in effect.parameters)
    yield f'| parameters | {parameters} |'
    yield f'| acts on | {effect.hook} |'
    yield f'| looks like | {effect.looks_like} |'
    yield f'| can be confused with | {effect.confused_with} |'
    yield f'| the run that shows it | {effect.reveal} |\n'


def _parameter(effect: Effect, parameter: Parameter) -> str:
    limits = {'V': 'the supply', 'rad/s': 'the rate of the robot file'}
    unlimited = limits.get(parameter.unit, 'so much that it limits nothing')
    neutral = unlimited if np.isinf(parameter.neutral) else f'{parameter.neutral:g}'
    if effect.hook == 'ground':
        neutral = "the ground's own"
    unit = f' [{parameter.unit}]' if parameter.unit else ''
    role = parameter.role if parameter.linear else f'{parameter.role}, not linear'
    return f'`{parameter.name}`{unit} ({role}), without effect at {neutral}'


def main(argv: list[str]) -> int:
    """Write all files, or tell whether they are as they would be written."""
    made = {'effects.md': page()} | {
        f'effects/{name}.svg': picture(*curve(effect)) for name, effect in EFFECTS.items()
    }
    return written(made, 'effects', argv)


def written(made: dict[str, str], folder: str, argv: list[str]) -> int:
    """Write files and take out the pictures of `folder` that are not among them, or check."""
    there = {str(p.relative_to(DOCS)) for p in DOCS.glob(f'{folder}/*.svg')}
    stale = sorted(
        name
        for name in {*made, *there}
        if not (DOCS / name).is_file() or (DOCS / name).read_text() != made.get(name)
    )
    if '--check' in argv:
        print(f'not up to date: {", ".join(stale)}' if stale else 'up to date')
        return int(bool(stale))
    (DOCS / folder).mkdir(exist_ok=True)
    for name in stale:
        (DOCS / name).write_text(made[name]) if name in made else (DOCS / name).unlink()
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
