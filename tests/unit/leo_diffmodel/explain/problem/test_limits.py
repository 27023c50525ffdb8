# SPDX-License-Identifier: Apache-2.0
"""What is plausible for a robot whose sizes are no distances."""

import numpy as np
import pytest
from tests.flywheel import flywheel

from leo_diffmodel.compare.sizes import push_scale
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.limits import limited
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.model import Model


@pytest.mark.parametrize('motor', [True, False], ids=['motor', 'passive'])
@pytest.mark.parametrize('gravity', [9.81, 0.0])
def test_a_wheel_whose_mass_is_on_its_axis_has_a_size(tmp_path, motor, gravity):
    model = Model(flywheel(tmp_path, motor, gravity))
    found = {
        (c.effect.name, p.name): p
        for c in candidates(model)
        for p in limited(c, model, SETTINGS.grids).parameters
    }
    assert all(p.low < p.high for p in found.values())
    radius = np.sqrt(4e-4 / 0.5)
    assert found['link_com', 'x'].high == pytest.approx(radius)
    most = found['coulomb_friction', 'c'].high
    assert most == pytest.approx(0.32 if motor else 0.5 * 9.81 * radius)
    assert (push_scale(model.robot) > 0).all()
