# SPDX-License-Identifier: Apache-2.0
"""The experiments on LEO by name: which cases, and what the thesis has beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from leo_learner.experiments.walking import ABLATION, Case, KNEE_ENDS

Group = tuple[str, str, str, str, str]
"""Robot, truth, agent, actions, config."""


@dataclass(frozen=True)
class Experiment:
    """Cases that are read together.

    Attributes:
        title: of its table and its figure.
        cases: in the order they are run.
        thesis: return and distance [m] that the thesis has for a group.
    """

    title: str
    cases: tuple[Case, ...]
    thesis: Mapping[Group, tuple[float, float]] = field(default_factory=dict)


def group(case: Case) -> Group:
    """What a case shares with those that differ by seed alone."""
    return case.robot, case.truth, case.agent, case.actions, case.config


def _cases(kind: Group, steps: int, seeds: Sequence[int]) -> tuple[Case, ...]:
    return tuple(Case(*kind, steps=steps, seed=seed) for seed in seeds)


IDEAL = ('leo', 'ideal', 'ddpg', 'full', 'recommended')
REAL = ('leo', 'real', 'ddpg', 'full', 'recommended')
LITERAL = ('leo', 'ideal', 'ddpg', 'full', f'thesis{KNEE_ENDS}')
KNEE_STOPS = ('leo', 'ideal', 'ddpg', 'full', 'thesis')
SYM = ('leo_ode', 'ideal', 'ddpg', 'sym', 'recommended')
FULL = ('leo_ode', 'ideal', 'ddpg', 'full', 'recommended')
SARSA = ('leo_ode', 'ideal', 'sarsa', 'sym', 'thesis')

EXPERIMENTS = {
    'walk': Experiment(
        'LEO learns to walk on the ideal model', _cases(IDEAL, 300_000, range(10))
    ),
    'literal': Experiment(
        'DDPG as the thesis has it',
        _cases(LITERAL, 300_000, range(2)) + _cases(KNEE_STOPS, 300_000, range(3)),
    ),
    'ablation': Experiment(
        'What each option is worth',
        tuple(
            case for name in ('recommended', *ABLATION)
            for case in _cases(('leo', 'ideal', 'ddpg', 'full', name), 200_000, range(2))
        ),
    ),
    'table3': Experiment(
        'Thesis Table 3: DDPG and SARSA on leo_ode',
        _cases(SYM, 300_000, range(4)) + _cases(FULL, 300_000, range(3))
        + _cases(SARSA, 1_000_000, range(2)),
        {SYM: (4573.0, 11.0), FULL: (2462.0, 7.92), SARSA: (2791.0, 7.80)},
    ),
    'real': Experiment(
        'LEO learns to walk on the real model', _cases(REAL, 300_000, range(4))
    ),
}  # fmt: skip
