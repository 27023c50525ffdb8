# SPDX-License-Identifier: Apache-2.0
"""The rows of explain.json: effects, hypotheses and errors with names and units."""

from __future__ import annotations

from leo_diffmodel.compare.headline import Figures
from leo_diffmodel.explain.estimate.fitted import effect_row
from leo_diffmodel.explain.findings.findings import Findings, Part, Rival
from leo_diffmodel.explain.problem.hypothesis import Candidate


def effect_rows(findings: Findings) -> list[dict]:
    """One row for each supported effect; its error before is that of the model without it."""
    return [_row(findings, part) for part in findings.effects]


def hypothesis_rows(findings: Findings) -> list[dict]:
    """All candidates on the model as given, best first; those never fitted have a scan only."""
    fitted = {part.candidate for part in findings.singles}
    before = findings.headline.mean(findings.ladder[0][1])
    rest = [
        _ruled_out(s.candidate, s.gain, before)
        for s in findings.search.scans
        if s.candidate not in fitted
    ]
    return [*(_row(findings, p) for p in findings.singles), *rest]


def errors(findings: Findings) -> dict:
    """Held-out errors before, after and the floor of noise, and what is left unexplained."""
    ladder = [*findings.ladder, ('noise floor', findings.floor)]
    seconds = findings.headline.seconds
    return findings.errors | {
        'ladder': [{'model': name, **figures, 'seconds': seconds} for name, figures in ladder],
        'windows': findings.windows,
        'statistic': findings.headline.statistic,
        'chi2_ratio': findings.rest.ratio,
        'unexplained_share': findings.rest.share,
    }


def stability(findings: Findings) -> list[dict]:
    """In what share of the held-out turns which set is chosen, the chosen one first."""
    sets = findings.choices.sets
    return [{'effects': list(labels), 'share': share} for labels, share in sets]


def shown_for(findings: Findings) -> dict[str, dict]:
    """Angle, speed and load that the answer was seen at, of each joint where its effects act."""
    return {
        joint: {
            name: each._asdict()
            for name, each in (('angle', angle), ('speed', speed), ('load', load))
        }
        for joint, angle, speed, load in findings.shown
    }


def not_testable(findings: Findings) -> list[dict]:
    """Effects that even at their largest amplitude would not rise above the threshold."""
    threshold = findings.search.threshold
    return [
        {
            'name': s.candidate.effect.name,
            'where': s.candidate.where,
            'why': f'its largest trace in this data is {s.evidence:.1f} nats, '
            f'{threshold:.1f} are needed; {s.candidate.effect.reveal}',
        }
        for s in findings.search.scans
        if s.evidence < threshold
    ]


def _row(findings: Findings, part: Part) -> dict:
    trained, held_out = part.saved
    return {
        **effect_row(part.fit, part.index),
        'gain_train': trained,
        'gain_held_out': held_out,
        **_errors(findings, part.before, part.after),
        'inclusion_probability': part.share,
        'confusable_with': [_rival(r) for r in part.rivals],
    }


def _errors(findings: Findings, before: Figures, after: Figures) -> dict:
    """Held-out errors of two fits: the mean over the states, and of each unit by itself."""
    told, units = findings.headline, [state['unit'] for state in findings.errors['states']]
    early, late = (told.by_unit(figures, units) for figures in (before, after))
    return {
        'error_before': told.mean(before),
        'error_after': told.mean(after),
        'errors': {unit: {'before': early[unit], 'after': late[unit]} for unit in early},
    }


def _rival(rival: Rival) -> dict:
    name, where = rival.candidate.effect.name, rival.candidate.where
    return {'name': name, 'where': where, 'separable_nats': rival.behind, 'same_thing': rival.same}


def _ruled_out(candidate: Candidate, promised: float, before: float) -> dict:
    return {
        'name': candidate.effect.name,
        'where': candidate.where,
        'parameters': {},
        'gain_train': promised,
        'gain_held_out': None,
        'error_before': before,
        'error_after': None,
        'errors': {},
        'inclusion_probability': 0.0,
        'confusable_with': [],
    }
