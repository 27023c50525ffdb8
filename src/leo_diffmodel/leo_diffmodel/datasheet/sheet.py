# SPDX-License-Identifier: Apache-2.0
"""A data sheet as datasheet.json has it (docs/datasheet.md)."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from leo_diffmodel.bags.states import deserialize
from leo_diffmodel.bags.types import SUPPLY, TEMPERATURE, Topic
from leo_diffmodel.compare import errors
from leo_diffmodel.datasheet.measure import Measured
from leo_diffmodel.datasheet.settings import FRICTION, Rung, TOGETHER, UNTOLD
from leo_diffmodel.explain.estimate.fitted import constant_rows, effect_row, Fit, unexplained
from leo_diffmodel.explain.select.evidence import Scored
from leo_msgs_py.bag_contents import BagContents, load

GIVEN = ('supply', 'limit', 'position_gain', 'rate_gain', 'resolution', 'goal_rate', 'efficiency')
"""Figures of robot.yaml that a sheet repeats, and does not measure."""


def sheet(found: Measured) -> dict[str, Any]:
    rung, final = found.ladder.chosen[0], found.final
    headline = found.held.headline
    return {
        'robot': found.model.robot.name,
        'joint': found.joint,
        'constants': constant_rows(final),
        'given': dict(_given(found)),
        'friction': {
            'law': rung.name,
            'rivals': [r.name for r in found.ladder.rivals],
            'effects': _effects(final, friction=True),
        },
        'ladder': [_rung(found, r, s) for r, s in found.ladder.rungs],
        'others': _effects(final, friction=False),
        'not_needed': [
            {**effect_row(s.fit, len(s.names) - 1), 'predicts_better': better}
            for s, better in found.alone
        ],
        'not_known': list(_not_known(final)),
        'error': {
            'figure': headline.words,
            'noise': headline.by_unit(headline.floor(found.held.predict(final)), _units(found)),
            'chi2_ratio': unexplained(final),
        },
        'notes': [*found.notes, *_left(found)],
    }


def _left(found: Measured) -> Iterator[str]:
    """What an interval cannot say: a law that is not the whole one is wrong in every block."""
    ratio = unexplained(found.final)
    if ratio > found.posed.problem.gates.unexplained:
        yield f'{ratio:.3g} times the noise is left: values may be off by more than intervals say'


def _given(found: Measured) -> Iterator[tuple[str, dict[str, Any]]]:
    robot, values = found.model.robot, found.model.constants
    links = [f'links.{joint.child}.mass' for joint in robot.joints if joint.name == found.joint]
    for path in (*(f'actuators.{found.joint}.{figure}' for figure in GIVEN), *links):
        constant = robot.constants.get(path)
        if constant and constant.uncertain is None and values[path]:
            yield path, {'value': float(values[path]), 'unit': constant.unit}


def _rung(found: Measured, rung: Rung, scored: Scored) -> dict[str, Any]:
    ladder, fitted = found.ladder, scored.fit
    _, best = ladder.chosen
    certificate = fitted.certificate
    return {
        'law': rung.name,
        'effects': _effects(fitted, friction=True),
        'constants': constant_rows(fitted),
        'error': found.held.headline.by_unit(found.held.figures(fitted), _units(found)),
        'behind_nats': ladder.weight.ahead(best, scored),
        'verdict': ladder.verdict(scored),
        'converged': certificate is not None and certificate.converged,
    }


def _not_known(fitted: Fit) -> Iterator[dict[str, Any]]:
    names, errors_of = _names(fitted), fitted.standard_errors
    scale = np.where(errors_of > 0, errors_of, 1.0)
    alike = fitted.covariance / np.outer(scale, scale) - np.eye(len(scale))
    for i, name in enumerate(names):
        low, high = fitted.ci95(i)
        wide = high - low > 2 * UNTOLD * abs(float(fitted.theta[i]))
        if not wide or name.startswith('sensors.'):
            continue
        other = int(np.argmax(np.abs(alike[i])))
        traded = names[other] if abs(alike[i, other]) > TOGETHER else None
        yield {'name': name, 'ci95': [low, high], 'exchanged_with': traded}


def _names(fitted: Fit) -> list[str]:
    hypothesis = fitted.hypothesis
    effects = [f'{c.label} {p.name}' for c in hypothesis.candidates for p in c.parameters]
    return [*effects, *(c.label for c in hypothesis.constants)]


def _effects(fitted: Fit, friction: bool) -> list[dict[str, Any]]:
    each = enumerate(fitted.hypothesis.candidates)
    return [effect_row(fitted, i) for i, c in each if (c.effect.name in FRICTION) == friction]


def _units(found: Measured) -> list[str]:
    return [state['unit'] for state in errors.state_names(found.model)]


def conditions(bags: Iterable[str], joint: str) -> list[dict[str, Any]]:
    """Of each bag its name, `supply` [V] and `temperature` [degC] as far as they were measured."""
    return [_row(load(Path(bag)), joint) for bag in bags]


def _row(contents: BagContents, joint: str) -> dict[str, Any]:
    volts = list(_values(contents, SUPPLY, 'voltage', joint))
    degrees = list(_values(contents, TEMPERATURE, 'temperature', joint))
    row: dict[str, Any] = {'bag': contents.path.name}
    row |= {'supply': _span(volts, 'V')} if volts else {}
    return row | ({'temperature': _span(degrees, 'degC')} if degrees else {})


def _values(contents: BagContents, topic: Topic, field: str, joint: str) -> Iterator[float]:
    """What was measured of the motor at a joint; a frame without a name is of all motors."""
    logs = [log for log in contents.of_type(topic.type) if log.name.endswith(topic.name)]
    for log in logs:
        for _, message in deserialize(log, topic.type):
            value = float(getattr(message, field))
            if message.header.frame_id in ('', joint) and np.isfinite(value):
                yield value


def _span(values: list[float], unit: str) -> dict[str, Any]:
    span = {'first': values[0], 'last': values[-1], 'least': min(values), 'most': max(values)}
    return span | {'unit': unit}
