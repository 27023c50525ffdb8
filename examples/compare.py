# SPDX-License-Identifier: Apache-2.0
"""How wrong a model is on a bag, where, and how much of it is only noise.

python examples/compare.py bags/friction torque_pendulum
"""

import sys

from leo_diffmodel import compare

if len(sys.argv) != 3:
    sys.exit('usage: python examples/compare.py BAG MODEL')
bag, model = sys.argv[1:]
result = compare(bag, model)
for i, state in enumerate(result.states):
    print(f'{state.name} [{state.unit}]: rms error / what a perfect model would score')
    for error in result.errors:
        print(f'  {error.seconds:6.2f} s ahead: {error.rmse[i]:.2g} / {error.noise_floor[i]:.2g}')
budget = result.budget
print(f'of the motion {budget.explained:.1%} explained, {budget.unexplained:.1%} missed')
if result.noise_only:
    print('no torque is missing beyond noise')
else:
    place = result.where[0]
    bounds = place.bin if isinstance(place.bin, str) else '{:.2g} to {:.2g}'.format(*place.bin)
    print(f'worst at {place.joint}, {place.variable} {bounds} {place.unit}'.rstrip(), end=': ')
    print(f'{place.torque_nm:.2g} {place.torque_unit}, {place.share:.0%} of the error')
