# SPDX-License-Identifier: Apache-2.0
"""The ladder: held-out error of the model as given, with each effect added, and the noise."""

from __future__ import annotations

from leo_diffmodel.explain.explanation import Explanation


def ladder(result: Explanation) -> list[dict]:
    """Rows {model, seconds, rmse, median per state} from ideal to repaired, noise last."""
    if result.search is None:
        return []
    return [*result.errors['ladder']]
