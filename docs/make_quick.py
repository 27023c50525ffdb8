# SPDX-License-Identifier: Apache-2.0
"""Make the recording that `leo demo --quick` explains: 8 s of a simulated robot with a secret.

python docs/make_quick.py     # from the repository's root; needs the folder not to be there
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from tests.simulate import bag, record, TORQUE
import yaml

from leo_sim.model.model_file import write_effects
from leo_sim.truth.drawing import draw
from leo_sim.truth.sealing import seal

FOLDER = Path('src/leo_learner/leo_learner/quick')
SEED, SECONDS = 17, 8.0


def main() -> None:
    """Draw the secret, record the robot with it, seal the truth beside the bag."""
    secret = draw(TORQUE, np.random.default_rng(SEED))
    run = record(TORQUE, secret, seconds=SECONDS, seed=SEED)
    bag(FOLDER / 'bag', replace(run, path=FOLDER / 'bag'))
    seal(
        FOLDER / 'secret.seal',
        yaml.safe_dump(
            {'robot': TORQUE.name, 'effects': write_effects([secret])}, sort_keys=False
        ),
    )


if __name__ == '__main__':
    main()
