# SPDX-License-Identifier: Apache-2.0
"""A fault that torques show is judged beside all effects: what predicts better is the answer."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from leo_diffmodel.explain import reading as module
from leo_diffmodel.explain.problem.usable import Logged
from leo_diffmodel.explain.reading import Asked, best_reading
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.finding import ERROR, WARNING

BLOCKS = np.array([3.0, 2.0, 4.0, 3.0, np.nan, 2.0])


def fault(name: str, gained: float = 3.0) -> Found:
    known = {'joint': 'pivot', 'value': 2.0, 'sd': 0.1, 'evidence': 'balance'}
    return Found(name, ERROR, 'it is', gained=gained, **known)


@pytest.fixture
def asked(monkeypatch):
    """A search whose errors are those of its log: (as it is, without its faults)."""

    def of(given: float, mended: float, noise: bool = False) -> Asked:
        searched.clear()

        def search(log, asked, until):
            searched.append(log)
            size = mended if log.mended else given
            problem = SimpleNamespace(sigma=np.ones((1, 2)))
            found = SimpleNamespace(problem=problem)
            answer = SimpleNamespace(log=log, search=found, leaves_noise=noise)
            answer.missed = lambda sigma: size * BLOCKS
            return answer

        monkeypatch.setattr(module, '_searched', search)
        return Asked(model=None, settings=SETTINGS, progress=None)

    monkeypatch.setattr(module, 'replace', lambda answer, log: SimpleNamespace(log=log))
    monkeypatch.setattr(
        Logged, 'without', lambda self, f: replace(self, mended=tuple(f)) if able(f) else self
    )
    searched: list[Logged] = []
    of.searched = searched
    return of


def able(faults) -> bool:
    return all(f.can_be_mended for f in faults)


def test_a_fault_stands_where_the_log_predicts_surely_better_without(asked):
    log = Logged((), (), faults=(fault('input_scale'),))
    assert best_reading(log, asked(given=2.0, mended=0.5), np.inf).log.in_the_way == [*log.faults]
    assert len(asked.searched) == 2


@pytest.mark.parametrize('mended', [1.0, 1.5])
def test_effects_that_do_as_well_leave_no_more_than_a_doubt(asked, mended):
    log = Logged((), (), faults=(fault('input_scale'),))
    told = best_reading(log, asked(given=1.0, mended=mended), np.inf).log
    assert not told.in_the_way and 'it is' in told.notes[0]


@pytest.mark.parametrize('noise', [True, False])
def test_what_cannot_be_undone_stands_unless_known_effects_leave_noise(asked, noise):
    log = Logged((), (), faults=(fault('gravity_compensated'),))
    told = best_reading(log, asked(given=1.0, mended=1.0, noise=noise), np.inf).log
    assert bool(told.in_the_way) is not noise and len(asked.searched) == 1


def test_a_log_as_given_and_one_without_faults_are_searched_once(asked):
    log = Logged((), (), faults=(fault('input_scale'),))
    one = asked(given=1.0, mended=0.1)
    assert best_reading(log, replace(one, as_given=True), np.inf).log is log
    assert best_reading(Logged((), ()), one, np.inf).log.faults == () and len(asked.searched) == 2


@pytest.mark.parametrize(('errors', 'stands'), [(1.9, False), (2.1, True)])
def test_a_fault_stands_from_two_standard_errors_on(asked, monkeypatch, errors, stands):
    monkeypatch.setattr(module, 'better', lambda _first, _second: errors)
    log = Logged((), (), faults=(fault('input_scale'),))
    assert bool(best_reading(log, asked(1.0, 1.0), np.inf).log.in_the_way) == stands


def test_what_torques_show_far_beyond_doubt_is_decided():
    sure, less = (fault('input_scale', LIMITS.decided * k) for k in (1.1, 0.9))
    assert Logged((), (), faults=(sure,)).decided
    assert not Logged((), (), faults=(less, replace(sure, severity=WARNING))).decided
