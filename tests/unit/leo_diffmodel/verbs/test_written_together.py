# SPDX-License-Identifier: Apache-2.0
"""The files of an answer are all there or none is."""

import pytest
from tests.simulate import bag, PENDULUM, record

from leo_diffmodel.verbs import compare, explain


@pytest.mark.parametrize(('verb', 'seconds'), [(explain, 1.0), (compare, 4.0)])
def test_where_the_report_cannot_be_written_there_is_no_json_either(tmp_path, verb, seconds):
    path = bag(tmp_path / 'run', record(PENDULUM, seconds=seconds))
    report = tmp_path / 'out/report.html'
    report.mkdir(parents=True)
    with pytest.raises(OSError, match=r'report\.html'):
        verb.main([str(path), '--model', 'pendulum', '-o', str(report.parent)])
    assert [*report.parent.iterdir()] == [report]


@pytest.mark.parametrize('each', [False, True])
def test_an_explanation_that_cannot_be_written_is_told(tmp_path, each, capsys):
    path = bag(tmp_path / 'run', record(PENDULUM, seconds=1.0))
    (tmp_path / 'out/run' if each else tmp_path / 'out').joinpath('report.html').mkdir(
        parents=True
    )
    with pytest.raises(OSError, match=r'report\.html'):
        explain.main(
            [str(path), '--model', 'pendulum', '-o', str(tmp_path / 'out'), *['--each'][:each]]
        )
    assert 'untestable' in capsys.readouterr().out
