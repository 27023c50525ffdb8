# SPDX-License-Identifier: Apache-2.0
"""Where names do not say it, what does the same later is measured; names are not overruled."""

from itertools import product

import numpy as np
import pytest
import yaml

from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.guess_lags import Goals, with_goals
from leo_diffmodel.bags.importing.guess_roles import roles_of
from leo_msgs_py.errors import UserError

T = np.arange(1200) / 50
GOAL = np.column_stack([np.sin(w * T) + 0.4 * np.sin(2.7 * w * T + w) for w in (1.1, 1.7, 2.3)])
LATE = np.vstack([GOAL[:1].repeat(6, axis=0), GOAL[:-6]]) * 0.95 + 0.002 * np.cos(99 * T)[:, None]


@pytest.mark.parametrize(
    ('measured', 'goal', 'late'),
    [
        *(('a', 'b', LATE), ('b', 'a', LATE), ('obs', 'act', LATE), ('arr_0', 'arr_1', LATE)),
        *(('q', 'b', LATE), ('b', 'goal', LATE), ('observation', 'action', -LATE[::-1])),
    ],
)
def test_what_follows_is_measured_where_names_do_not_say_it(tmp_path, measured, goal, late):
    log, goals = tmp_path / 'log.npz', GOAL if late is LATE else -GOAL[::-1]
    np.savez(log, t=T, **dict(sorted({measured: late, goal: goals}.items())))
    said = yaml.safe_load(guess_map(log, tmp_path / 'map.yaml').read_text())
    found = [of['position']['column'] for p in ('joints', 'inputs') for of in said[p].values()]
    assert found == [f'{name}[{k}]' for name in (measured, goal) for k in range(3)]
    import_logs([log], tmp_path / 'map.yaml', tmp_path / 'bag')


def test_where_neither_is_later_the_map_asks_and_what_moves_otherwise_is_none(tmp_path):
    np.savez(tmp_path / 'log.npz', t=T, a=GOAL, b=0.9 * GOAL)
    text = guess_map(tmp_path / 'log.npz', tmp_path / 'map.yaml').read_text()
    assert 'a[0] to a[2] and b[0] to b[2] do the same and neither is surely later: which' in text
    with pytest.raises(UserError, match='fill in the unit of position in the column map'):
        import_logs([tmp_path / 'log.npz'], tmp_path / 'map.yaml', tmp_path / 'bag')
    np.savez(tmp_path / 'log.npz', t=T, a=GOAL, b=GOAL[:, ::-1])
    with pytest.raises(UserError, match='columns have numbers and no names'):
        guess_map(tmp_path / 'log.npz', tmp_path / 'other.yaml')
    np.savez(tmp_path / 'log.npz', t=T, q=GOAL, b=LATE)
    assert 'counts as passive' in guess_map(tmp_path / 'log.npz', tmp_path / 'q.yaml').read_text()


def test_counters_a_circle_a_gait_and_several_that_follow_are_no_goals():
    frames, swing = {'frame': T, 'seq': T + 1}, {'x': np.sin(4 * T), 'y': np.cos(4 * T)}
    gait = {f'{n}_{k}': np.sin(4 * T + p) for p, (n, k) in enumerate(product(*['ab', ['l', 'r']]))}
    several = {'a': LATE[:, 0], 'b': GOAL[:, 0], 'c': 0.9 * GOAL[:, 0]}
    with np.errstate(all='raise'):
        for table in (frames, swing, gait, several, {'flag': 0 * T, 'q': LATE[:, 0]}):
            roles = roles_of(table)
            assert with_goals(roles, {'t': T, **table}) == Goals(dict(roles))
        (note,) = with_goals(roles_of('ab'), {'a': np.sin(4 * T), 'b': np.sin(4 * T - 0.1)}).notes
    assert 'neither is surely later' in note
