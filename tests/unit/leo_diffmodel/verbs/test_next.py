# SPDX-License-Identifier: Apache-2.0
"""What leo next says to type."""

from leo_diffmodel.verbs.next import predict_words
from leo_sim.model import Model


def test_play_predicts_by_the_model_that_chose_the_run():
    model = Model('pendulum')
    assert predict_words('pendulum', model) == []
    assert predict_words('my model.yaml', model) == ['--predict', 'my model.yaml']
