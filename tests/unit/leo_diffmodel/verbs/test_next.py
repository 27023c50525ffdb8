# SPDX-License-Identifier: Apache-2.0
"""What leo next says to type, and what it reads."""

import json

import pytest
from tests.damage_shop import EXPLANATION
from tests.simulate import bag, PENDULUM, record

from leo_diffmodel.verbs.next import main, predict_words
from leo_msgs_py.errors import UserError
from leo_sim.model import Model


def test_play_predicts_by_the_model_that_chose_the_run():
    model = Model('pendulum')
    assert predict_words('pendulum', model) == []
    assert predict_words('my model.yaml', model) == ['--predict', 'my model.yaml']


@pytest.mark.parametrize(
    ('change', 'said'),
    [
        ({'provenance': {}}, 'provenance.robot'),
        ({'provenance': EXPLANATION['provenance'] | {'bags': [{}]}}, 'bags.0.sha256'),
        ({'not_testable': [{'name': 'backlash'}]}, 'not_testable.0.where'),
        ({'effects': [{'name': 'backlash', 'where': 'pivot'}]}, 'effects.0'),
    ],
)
def test_what_is_wrong_in_an_explanation_is_one_line(change, said, tmp_path):
    path, run = tmp_path / 'explain.json', bag(tmp_path / 'run', record(PENDULUM, seconds=1.0))
    path.write_text(json.dumps(EXPLANATION | change))
    with pytest.raises(UserError, match=rf'explain.json: \S*{said}'):
        main([str(run), '--model', 'pendulum', '--explain', str(path)])
