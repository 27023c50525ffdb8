# SPDX-License-Identifier: Apache-2.0
"""What keeps an effect, or the whole answer, from being sure."""

from __future__ import annotations

from collections.abc import Iterator

from leo_diffmodel.explain.findings.findings import Findings, Part
from leo_diffmodel.explain.problem.candidates import at_limit
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices


def doubt(findings: Findings, part: Part) -> str:
    """Why an effect is not sure; '' where it is."""
    fitted, parameters = part.fit, part.candidate.parameters
    first = fitted.hypothesis.offset(part.index)
    sizes = [
        (parameters[i], float(fitted.theta[first + i]), fitted.ci95(first + i))
        for i in amplitude_indices(parameters)
    ]
    if not any(low > p.neutral or high < p.neutral for p, _, (low, high) in sizes):
        return 'whose interval holds no effect'
    if any(at_limit(p, v, 0.5 * (high - low)) for p, v, (low, high) in sizes):
        return 'at the limit of what is plausible'
    if part.share < findings.gates.stable:
        return f'chosen in {part.share:.0%} of the held-out turns'
    if findings.floors and findings.floors[part.index] < findings.gates.least_floors:
        return 'below the noise floor, as many small differences are'
    return ''


def instead(findings: Findings, part: Part) -> list[str]:
    """What is chosen in its place in too many of the turns for it to be sure."""
    stable = findings.gates.stable
    if part.share >= stable:
        return []
    most = findings.choices.instead[: findings.numerics.listed]
    return [label for label, share in most if share > 0.5 * (1 - stable)]


def beside(findings: Findings) -> str:
    """What too many of the turns choose beside the chosen effects for it to be all; else ''."""
    choices = findings.choices
    (chosen, share), told = choices.sets[0], choices.beside[: findings.numerics.listed]
    if not (chosen and told) or share >= findings.gates.stable:
        return ''
    listed = ', '.join(f'{label} in {share:.0%}' for label, share in told)
    return f'beside them the held-out turns choose {listed}'


def doubts(findings: Findings) -> list[str]:
    """What keeps the whole answer from being sure, in words."""
    told = [*_on_limits(findings)]
    if (kept := findings.choices.kept) < findings.gates.stable:
        told.append(f'this set is chosen in {kept:.0%} of the held-out turns')
    told += _disagreements(findings)
    if findings.other:
        told.append(f'{findings.other} would leave less unexplained')
    if findings.refuted:
        told.append(f'{findings.refuted} has a smaller held-out error')
    certificate = findings.final.certificate
    if certificate and not certificate.converged:
        told.append(
            f'{certificate.starts} starts of the fit end at different values'
            if certificate.starts > 1
            else 'the fit has not come to its end'
        )
    return [*told, *_untried(findings)]


def _untried(findings: Findings) -> Iterator[str]:
    """What there was no time for."""
    untried, most = findings.search.untried, findings.numerics.listed
    more = len(untried) - most
    if untried:
        listed = ', '.join(untried[:most]) + (f' and {more} more' if more > 0 else '')
        yield f'the time was over; not tried: {listed}'


def _on_limits(findings: Findings) -> Iterator[str]:
    """Constants that run onto the ends of their declared ranges."""
    theta, full = findings.final.theta, findings.final.hypothesis
    for i, c in enumerate(full.constants, full.size - len(full.constants)):
        if not full.low[i] < theta[i] < full.high[i]:
            yield f'{c.label} runs onto its limit {theta[i]:.3g} {c.unit}'.rstrip()


def _disagreements(findings: Findings) -> Iterator[str]:
    """Effects of which two recordings ask for values that exclude each other, in words.

    They differ by more than `disagree` of the joint value as well: on a real robot
    everything differs a little.
    """
    for part, values in zip(findings.effects, findings.own, strict=True):
        first = part.fit.hypothesis.offset(part.index)
        for i, own in values.items():
            parameter, value = part.candidate.parameters[i - first], float(part.fit.theta[i])
            low = min(own, key=lambda o: o.value + o.half, default=None)
            high = max(own, key=lambda o: o.value - o.half, default=None)
            if low is None or high is None or low.value + low.half >= high.value - high.half:
                continue
            least = findings.gates.disagree * abs(value - parameter.neutral)
            if high.value - low.value > least:
                yield (
                    f'the bags disagree about {part.candidate.label}: {parameter.name} is '
                    f'{low.value:.3g} in {low.bag} and {high.value:.3g} in {high.bag}; '
                    '--each explains them one by one'
                )
