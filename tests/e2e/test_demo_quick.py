# SPDX-License-Identifier: Apache-2.0
"""leo demo --quick explains the shipped recording and finds its secret."""

import json

import pytest

from leo_learner.verbs.demo import SHIPPED
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.verbs.reveal import read_sealed


def test_the_secret_is_found(tmp_path, capsys):
    main(['demo', '--quick', '--json', '-o', str(tmp_path / 'out')])
    answer, truth = map(json.loads, _documents(capsys.readouterr().out))
    assert truth == read_sealed(SHIPPED / 'secret.seal')
    (secret,), (found, *_) = truth['effects'], answer['effects']
    known = {found['name'], *(other['name'] for other in found['confusable_with'])}
    assert secret['name'] in known
    assert (tmp_path / 'out/report.html').is_file()


def _documents(text):
    """The explanation in a line, and the truth after it."""
    first, _, rest = text.partition('\n')
    return first, rest


def test_nothing_is_written_over(tmp_path):
    from leo_learner.verbs.demo import main as demo

    with pytest.raises(UserError, match='exists'):
        demo(['--quick', '-o', str(tmp_path)])
