# SPDX-License-Identifier: Apache-2.0
"""Where names do not say it, what does the same later is measured; names are not overruled."""

import numpy as np
import pytest
import yaml

from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.importing.guess import guess_map
from leo_msgs_py.errors import UserError

T = np.arange(1200) / 50
GOAL = np.column_stack([np.sin(w * T) + 0.4 * np.sin(2.7 * w * T + w) for w in (1.1, 1.7, 2.3)])
LATE = np.vstack([GOAL[:1].repeat(6, axis=0), GOAL[:-6]]) * 0.95 + 0.002 * np.cos(99 * T)[:, None]


def guessed(folder, arrays):
    np.savez(folder / 'log.npz', t=T, **arrays)
    text = guess_map(folder / 'log.npz', folder / 'map.yaml').read_text()
    said = yaml.safe_load(text)
    parts = said['joints'], said.get('inputs', {})
    found = [{j: of['position']['column'] for j, of in part.items()} for part in parts]
    return *found, text


@pytest.mark.parametrize(
    ('measured', 'goal'),
    [('a', 'b'), ('b', 'a'), ('observation', 'act'), ('obs', 'action'), ('q', 'b'), ('b', 'goal')],
)
def test_what_follows_is_measured(tmp_path, measured, goal):
    joints, inputs, text = guessed(tmp_path, dict(sorted({measured: LATE, goal: GOAL}.items())))
    assert [*joints.values()] == [f'{measured}[{k}]' for k in range(3)]
    assert [*inputs.values()] == [f'{goal}[{k}]' for k in range(3)]
    assert f'{measured}[0] to {measured}[2] do what {goal}[0] to {goal}[2] do 6 samples b' in text
    import_logs([tmp_path / 'log.npz'], tmp_path / 'map.yaml', tmp_path / 'bag')


@pytest.mark.parametrize('scale', [1.0, 0.9])
def test_where_neither_is_later_the_map_asks(tmp_path, scale):
    _, _, text = guessed(tmp_path, {'a': GOAL, 'b': scale * GOAL})
    assert 'a[0] to a[2] and b[0] to b[2] do the same and neither is later: which was' in text
    with pytest.raises(UserError, match='fill in the unit of position in the column map'):
        import_logs([tmp_path / 'log.npz'], tmp_path / 'map.yaml', tmp_path / 'bag')


def test_names_that_say_it_are_not_overruled(tmp_path):
    joints, inputs, _ = guessed(tmp_path, {'action': LATE, 'observation': GOAL})
    assert joints['joint0'] == 'observation[0]' and inputs['joint0'] == 'action[0]'
    (tmp_path / 'map.yaml').unlink()
    joints, inputs, text = guessed(tmp_path, {'q': GOAL, 'b': LATE})
    assert joints['joint0'] == 'q[0]' and not inputs and 'counts as passive' in text


def test_what_moves_otherwise_is_no_goal(tmp_path):
    with pytest.raises(UserError, match='columns have numbers and no names'):
        guessed(tmp_path, {'a': GOAL, 'b': GOAL[:, ::-1]})
