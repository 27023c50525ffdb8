# SPDX-License-Identifier: Apache-2.0
"""What is different where a robot touches the ground.

Contacts come and go with a small change of a start state or a parameter, so that the loss is rough
and one window may say thousands of nats for the wrong reason; and every rollout is expensive.
"""

from __future__ import annotations

from typing import Any

ON_GROUND: dict[str, Any] = {
    # contacts begin and end in longer windows
    'search_seconds': 0.1,
    'least_samples': 4,
    'longer_seconds': (),
    # a model for the ground has a scheme of its own, see `compare.scheme`
    'longest_step': 0.0,
    # start states are settled window by window, each with a size of its own
    'shared': 0.0,
    # a window in which a contact flips neither decides nor moves the parameters
    'step_nats': 0.5,
    'moving': 2.0,
    'most_leverage': 1.5,
    'window_nats': 6.0,
    # a law that acts in a sixth of the windows is seen; contacts that flip make up less (ten runs
    # of LEO without an effect: at most 1.15 times the noise here)
    'seen_at': 0.85,
    # in a few windows contacts that flip decide the error; these overlap
    'held_windows': 40,
    # each stretch is a rollout with contacts, and a law many
    'stretches': 3,
    'sparing': True,
}
"""Numbers by the names of their fields in the three objects."""
