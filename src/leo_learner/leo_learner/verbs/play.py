# SPDX-License-Identifier: Apache-2.0
"""`leo play`: run a policy, a run file or a motion on a model, or on the running robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
import json
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser, ros_args_apart
from leo_sim.common.consent import add_effect_argument

if TYPE_CHECKING:
    from leo_diffmodel.difference.model import DifferenceModel
    from leo_learner.environment.rollouts import Recorded, Rollouts
    from leo_sim.model import Model

EXAMPLES = """\
  leo play runs/ideal/policy.safetensors --model pendulum
  leo play leo_walk --bag walk                           (shipped; then leo bag show walk)
  leo play runs/ideal/policy.safetensors --episodes 20 --model repaired/model.yaml
  leo play runs/ideal/policy.safetensors --model leo --difference run/difference-001.safetensors
  leo play runs/ideal/policy.safetensors                 (on the robot: leo run leo_sim robot)
  leo play runs/ideal/policy.safetensors --collect 5000  (with noise, to record a rollout)
  leo play next_run.csv --bag bags/next                  (the run of leo next; shows it and asks)
  leo play swinging --seconds 6 --bag bags/hang          (a motion on the robot, recorded)
  leo play stepping --seed 3 --model leo --bag ideal     (a motion on a model)"""

LONGEST = 3600.0


def main(argv: list[str]) -> int:
    parser = Parser(
        'leo play', 'Run a policy, a run file or a motion, on the robot or a model.', EXAMPLES
    )
    parser.add(
        'policy POLICY',
        'policy.safetensors of leo learn, the name of a shipped one, a run '
        'file (.csv) of leo next, or a motion of a walker: swinging '
        '(hanging), standing, stepping (with its falls)',
        type=Path,
    )
    parser.add('--model M', 'model file or robot; without it the robot')
    parser.add(
        '--difference FILE',
        'say where a policy leaves the data of this difference model, on M '
        'corrected by it, or on the robot',
        type=Path,
    )
    parser.add(
        '--bag DIR',
        'write what it did to a bag: what M did, and without --model what '
        'the ideal robot did under a policy, or the running one otherwise',
        type=Path,
    )
    parser.flag('--yes', 'send a run file without asking, unless it hits a stop')
    parser.add(
        '--predict M',
        'model file for the dry run of a run file before it is sent (the robot it names)',
    )
    parser.add_argument('--episodes', type=int, default=1, metavar='N')
    parser.add('--collect STEPS', 'drive STEPS with noise', type=int)
    parser.add('--seconds T', 'length of a motion (10)', type=float)
    parser.add('--seed S', 'of random starts, and of the figures of a motion', default=0)
    add_effect_argument(parser)
    words, ros_args = ros_args_apart(argv)
    options = parser.parse_args(words)
    _check(options)
    result, text = _played_by(options, ros_args)
    print(json.dumps(result) if options.json else text(result))
    return 0 if result.get('complete', True) else 1


def _check(options: Any) -> None:
    from leo_diffmodel.next_run.run_file import is_run_file
    from leo_sim.task.motions import MOTIONS

    run, motion = is_run_file(options.policy), str(options.policy) in MOTIONS
    if options.episodes < 1 or (options.collect is not None and options.collect < 1):
        raise UserError('leo play: --episodes and --collect take 1 or more')
    if options.seed < 0:
        raise UserError('leo play: --seed takes 0 or more')
    if options.seconds is not None and not (motion and 0 < options.seconds <= LONGEST):
        raise UserError(
            f'leo play: --seconds is the length of a motion, above 0 and up to {LONGEST:g} s'
        )
    if options.bag and run and options.model:
        raise UserError('leo play: --bag records a run file on the robot, not on a model')
    if options.bag and options.bag.exists():
        raise UserError(f'{options.bag} exists; choose another folder for --bag')
    if options.difference and (run or motion):
        raise UserError('leo play: --difference watches a policy; give one')
    if options.predict and (options.model or not run):
        raise UserError('leo play: --predict is for a run file that is sent to the robot')
    if options.collect and run:
        raise UserError('leo play: --collect takes a policy; a run file is played as it is')


def _played_by(options: Any, ros_args: list[str]) -> tuple[dict[str, Any], Callable[..., str]]:
    from leo_diffmodel.next_run.run_file import is_run_file
    from leo_learner.verbs.play_run import play_run, run_text
    from leo_learner.verbs.play_scripted import motion_text, play_motion
    from leo_sim.task.motions import MOTIONS

    if is_run_file(options.policy):
        return play_run(options, ros_args), run_text
    if str(options.policy) in MOTIONS:
        return play_motion(options, ros_args), motion_text
    return _play(options, ros_args), _text


def _play(options: Any, ros_args: list[str]) -> dict[str, Any]:
    from leo_learner.environment.rollouts import Recorded
    from leo_learner.environment.walk import Walk, walks
    from leo_learner.learning.collect import collect
    from leo_learner.learning.policy import Policy, shipped
    from leo_learner.training.loop import play
    from leo_learner.verbs.play_run import playing
    from leo_learner.verbs.play_scripted import unknown
    from leo_sim.model.model_file import load_model

    if not options.policy.is_file() and str(options.policy) not in shipped():
        raise unknown(str(options.policy), shipped())
    policy = Policy.load(options.policy)
    if options.bag and not options.model:
        options.model = policy.robot
    model = load_model(options.model or policy.robot)
    policy.check(model.robot)
    result = {'policy': str(options.policy), 'on': options.model or 'the robot'}
    with _stage(options, model, ros_args) as stage:
        recorded = Recorded(policy.on(stage.env), stage.known())
        if options.collect:
            with playing(options.collect) as step:
                collect(recorded, policy, options.collect, options.seed, step)
            result['collected'] = options.collect
        else:
            figures: list[Walk] = []
            with playing(options.episodes) as played:

                def note() -> None:
                    played()
                    if walks(model.robot):
                        figures.append(recorded.walk())

                returns = play(recorded, policy, options.episodes, options.seed, note)
            result |= {'returns': returns.tolist(), 'mean': float(returns.mean())}
            if figures:
                result['walks'] = [asdict(walk) for walk in figures]
    return result | stage.notes(options, recorded)


@dataclass(frozen=True)
class _Stage:
    env: Any
    path: Path | None = None  # of the difference model
    difference: DifferenceModel | None = None
    rollouts: Rollouts | None = None

    def known(self) -> DifferenceModel | None:
        return self.difference if self.difference and self.difference.trust else None

    def notes(self, options: Any, recorded: Recorded) -> dict[str, Any]:
        notes: dict[str, Any] = {}
        if self.path is not None:
            left = [asdict(e) for e in recorded.left()] if self.known() else None
            notes |= {'difference': str(self.path), 'left_data': left}
        if self.rollouts is not None:
            self.rollouts.write(options.bag)
            notes['bag'] = str(options.bag)
        return notes


@contextmanager
def _stage(options: Any, model: Model, ros_args: list[str]) -> Iterator[_Stage]:
    from leo_diffmodel.difference.model import read_difference
    from leo_learner.environment.env import model_env
    from leo_learner.environment.rollouts import Rollouts

    if not options.model:
        path = options.difference
        difference = path and read_difference(path, model.robot)
        from leo_learner.robot.running import running_robot

        with running_robot(ros_args) as running:
            yield _Stage(running.env(model.robot), path, difference)
        return
    if options.difference:
        model = model.changed(difference_model=options.difference)
    env = model_env(model)
    rollouts = Rollouts(env) if options.bag else None
    try:
        yield _Stage(rollouts or env, model.difference_model, env.difference, rollouts)
    except KeyboardInterrupt:
        if rollouts is not None and rollouts.recording().episodes:
            rollouts.write(options.bag)
            print(f'stopped: wrote {options.bag} with what was played so far', file=sys.stderr)
        raise


def walk_text(walk: Mapping[str, Any]) -> str:
    cost = walk['energy_per_metre']
    return (
        f'{walk["distance"]:.2f} m in {walk["footsteps"]} footsteps (feet passed each other '
        f'{walk["passes"]} times), {walk["energy"]:.0f} J'
        f'{"" if cost is None else f" ({cost:.1f} J/m)"}, '
        f'{"fell after" if walk["fell"] else "upright for"} {walk["seconds"]:.2f} s'
    )


def _text(result: dict[str, Any]) -> str:
    driven = f'{result.get("collected")} transitions driven on {result["on"]}'
    lines = [driven] if 'collected' in result else _played(result)
    if 'bag' in result:
        lines.append(f'wrote {result["bag"]}; next: {leo("bag", "show", result["bag"])}')
    return '\n'.join(lines)


def _played(result: dict[str, Any]) -> list[str]:
    from leo_learner.environment.rollouts import Left

    each = ', '.join(f'{value:.1f}' for value in result['returns'])
    lines = [
        f'return on {result["on"]}: {each}',
        f'mean of {len(result["returns"])}: {result["mean"]:.1f}',
        *map(walk_text, result.get('walks', ())),
    ]
    if 'difference' in result and result['left_data'] is None:
        lines.append(f'{result["difference"]}: a single network: where its data end is unknown')
    for number, row in enumerate(result.get('left_data') or (), 1):
        lines.append(f'episode {number}: {Left(**row)}')
    return lines
