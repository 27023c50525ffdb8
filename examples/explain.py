# SPDX-License-Identifier: Apache-2.0
"""Which effect a model lacks; the model with it; how much better that is on another bag.

python examples/explain.py bags/friction bags/other torque_pendulum repaired.yaml
"""

import sys

from leo_diffmodel import add, compare, explain
from leo_sim.model import load_model, save_model

if len(sys.argv) != 5:
    sys.exit('usage: python examples/explain.py BAG OTHER MODEL NEW.yaml')
bag, other, name, new = sys.argv[1:]
model = load_model(name)
answer = explain(bag, model)
print(f'{answer.verdict}: {answer.sentence}')
for effect in answer.effects:
    for parameter, fitted in effect.parameters.items():
        low, high = fitted.ci95
        print(
            f'{effect.name} at {effect.where}: {parameter} = {fitted.value:.4g} {fitted.unit} '
            f'(95 %: {low:.4g} to {high:.4g})'
        )
    print('  or:', ', '.join(rival.name for rival in effect.confusable_with) or 'nothing else')
if answer.effects:
    repaired = add(model, answer)
    print('wrote', save_model(new, repaired))
    for before, after in zip(compare(other, model).errors, compare(other, repaired).errors):
        print(
            f'{after.seconds:5.2f} s ahead on {other}: {before.rmse[0]:.2g} -> '
            f'{after.rmse[0]:.2g} (noise {after.noise_floor[0]:.2g})'
        )
