# SPDX-License-Identifier: Apache-2.0
"""leo explain --why: the rules of the answer, which fired, with what number; fitted sets."""

import pytest
from tests.searched import among
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.verbs.explain import main
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.mark.parametrize('why', [True, False])
def test_the_rules_of_the_answer_are_printed(tmp_path, capsys, monkeypatch, why):
    among(monkeypatch, Model(TORQUE), 'viscous_friction', 'bias_torque')
    monkeypatch.setenv('COLUMNS', '200')
    friction = place(TORQUE, 'viscous_friction', 'pivot', b=0.05)
    folder = bag(tmp_path / 'bag', record(TORQUE, friction, seconds=8))
    assert main([str(folder), '--model', 'torque_pendulum', *['--why'][: int(why)]]) == 0
    rows = [line.split('│') for line in capsys.readouterr().out.splitlines() if '│' in line]
    cells = {row[1].strip(): [cell.strip() for cell in row[2:6]] for row in rows}
    assert ('set chosen too seldom' in cells) is why
    if why:
        assert cells['set chosen too seldom'] == ['', 'no', '1', '0.9']
        assert cells['chosen too seldom'][:2] == ['viscous_friction:pivot', 'no']
        assert cells['named: nothing open'][1] == 'yes'
        assert cells['viscous_friction:pivot'][1:3] == ['0.0', 'yes']
        assert float(cells['nothing is missing'][1]) < -100
        assert 'rad/s' in cells['nothing is missing'][0]
