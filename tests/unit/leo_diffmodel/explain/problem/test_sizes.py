# SPDX-License-Identifier: Apache-2.0
"""Where a scan begins: at what this robot and these data make large in the unit."""

from dataclasses import replace

import numpy as np
import pytest
from tests.bearing_drag import BEARING_DRAG
from tests.simulate import PENDULUM, record, TORQUE

from leo_diffmodel.compare.sizes import torque_scale
from leo_diffmodel.compare.windows import cut
from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.settings import SETTINGS
from leo_msgs_py.errors import UserError
from leo_sim.effects import get_effect
from leo_sim.model import Model


def written(folder, unit='N m s3/rad3'):
    file = folder / 'bearing_drag.py'
    file.write_text(BEARING_DRAG.replace('N m s3/rad3', unit))
    return get_effect(str(file))


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE], ids=lambda r: r.name)
def test_the_example_of_the_readme_starts_below_the_stall_torque(robot, tmp_path):
    model, effect = Model(robot), written(tmp_path)
    scales = scales_of(model, cut([record(robot, seconds=4)], 0.1))
    (drag,) = (c for c in candidates(model, [effect]) if c.effect is effect)
    sizes = scales.amplitudes(effect.name, drag.parameters[0], SETTINGS.grids)
    first, *_, most = sizes * scales.rate**3
    np.testing.assert_allclose([first, most], np.array([0.004, 0.3]) * torque_scale(robot))


def test_a_factor_of_an_angle_of_many_turns_starts_small():
    log = record(TORQUE, seconds=4)
    (e,) = log.episodes
    spun = replace(log, episodes=(replace(e, q=e.q + 200.0),))
    for recording, largest in ((log, np.abs(e.q).max()), (spun, np.abs(e.q + 200.0).max())):
        scales = scales_of(Model(TORQUE), cut([recording], 0.1))
        first, *_, most = scales.of_readings(SETTINGS.grids)
        assert first * max(largest, 1.0) == pytest.approx(0.004, rel=0.1)
        assert most == pytest.approx(0.3)


def test_a_unit_that_has_no_size_is_one_line(tmp_path):
    model, effect = Model(TORQUE), written(tmp_path, 'A')
    (drag,) = (c for c in candidates(model, [effect]) if c.effect is effect)
    with pytest.raises(UserError, match=r"^bearing_drag\.c: how large is large in 'A'\? [^\n]*$"):
        limited(drag, model, SETTINGS.grids)
