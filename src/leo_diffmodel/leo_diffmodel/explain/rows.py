# SPDX-License-Identifier: Apache-2.0
"""The rows of explain.json, read off the findings: names, units and figures."""

from collections.abc import Collection
import math
from typing import Any

from leo_diffmodel.compare.headline import Figures
from leo_diffmodel.explain.estimate.fitted import constant_rows, effect_row
from leo_diffmodel.explain.findings.findings import Findings, Part
from leo_diffmodel.explain.problem.hypothesis import Candidate


def rows(findings: Findings, unsure: Collection[str]) -> dict[str, Any]:
    """The fields of explain.json that say what was found, by their names.

    `unsure`: labels of the effects beside those that a `partly` is sure of.
    """
    certificate, sets = findings.final.certificate, findings.choices.sets
    apart = [part.candidate.label in unsure for part in findings.effects]
    found = [*zip(apart, (_row(findings, part) for part in findings.effects), strict=True)]
    return {
        'effects': [row for beside, row in found if not beside],
        'not_sure': [row for beside, row in found if beside],
        'constants': constant_rows(findings.final),
        'hypotheses': _hypotheses(findings),
        'sets': _sets(findings),
        'not_testable': _not_testable(findings),
        'errors': _errors(findings),
        'stability': [{'effects': list(labels), 'share': share} for labels, share in sets],
        'fit': certificate.to_json() if certificate else None,
        'shown_for': shown_for(findings),
    }


def shown_for(findings: Findings) -> dict[str, dict]:
    """Angle, speed and load that the answer was seen at, of each joint where its effects act."""
    return {
        s.joint: {name: getattr(s, name)._asdict() for name in ('angle', 'speed', 'load')}
        for s in findings.shown
    }


def not_shown(candidate: Candidate, why: str) -> dict[str, str]:
    return {**_names(candidate), 'why': why}


def _names(candidate: Candidate) -> dict[str, str]:
    return {'name': candidate.effect.name, 'where': candidate.where}


def _not_testable(findings: Findings) -> list[dict[str, str]]:
    shown = [part.candidate for part in findings.effects]
    shown += [r.candidate for part in findings.effects for r in part.rivals if r.same]
    threshold = findings.search.threshold
    why = 'its largest trace in this data is {:.1f} nats, {:.1f} are needed; {}'
    return [
        not_shown(s.candidate, why.format(s.evidence, threshold, s.candidate.effect.reveal))
        for s in findings.search.scans
        if s.evidence < threshold and s.candidate not in shown
    ]


def _hypotheses(findings: Findings) -> list[dict]:
    """All candidates on the model as given, best first; those never fitted have a scan only."""
    fitted = {part.candidate for part in findings.singles}
    before = findings.headline.mean(findings.ladder[0][1])
    scanned: list[dict] = [
        {
            **_names(scan.candidate),
            'parameters': {},
            'gain_train': scan.gain,
            'gain_held_out': None,
            'error_before': before,
            'error_after': None,
            'errors': {},
            'inclusion_probability': 0.0,
            'confusable_with': [],
        }
        for scan in findings.search.scans
        if scan.candidate not in fitted
    ]
    return [*(_row(findings, part) for part in findings.singles), *scanned]


def _sets(findings: Findings) -> list[dict]:
    found, statistic = findings.search, findings.headline.statistic
    return [
        {
            'effects': [c.label for c in s.fit.hypothesis.candidates],
            'error_held_out': figures[statistic],
            'score': found.weight.ahead(s, found.sets[0]),
            'ended': s.fit.ended,
        }
        for s, figures in zip(found.sets, findings.of_sets, strict=True)
        if all(map(math.isfinite, figures[statistic]))
    ]


def _row(findings: Findings, part: Part) -> dict:
    """An effect; its error before is that of the hypothesis without it."""
    trained, held_out = part.saved
    rivals = [
        {**_names(r.candidate), 'separable_nats': r.behind, 'same_thing': r.same}
        for r in part.rivals
    ]
    return {
        **effect_row(part.fit, part.index),
        'gain_train': trained,
        'gain_held_out': held_out,
        **_changed(findings, part.before, part.after),
        'inclusion_probability': part.share,
        'confusable_with': rivals,
    }


def _changed(findings: Findings, before: Figures, after: Figures) -> dict:
    """Held-out errors of two fits: the mean over the states, and of each unit by itself."""
    headline, units = findings.headline, [state['unit'] for state in findings.errors['states']]
    early, late = (headline.by_unit(figures, units) for figures in (before, after))
    return {
        'error_before': headline.mean(before),
        'error_after': headline.mean(after),
        'errors': {unit: {'before': early[unit], 'after': late[unit]} for unit in early},
    }


def _errors(findings: Findings) -> dict:
    ladder = [*findings.ladder, ('noise floor', findings.floor)]
    seconds = findings.headline.seconds
    return findings.errors | {
        'ladder': [{'model': name, **figures, 'seconds': seconds} for name, figures in ladder],
        'windows': findings.windows,
        'statistic': findings.headline.statistic,
        'chi2_ratio': findings.rest.ratio,
        'unexplained_share': findings.rest.share,
    }
