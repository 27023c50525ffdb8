# SPDX-License-Identifier: Apache-2.0
"""What can be read of a bag while it is being recorded."""

from pathlib import Path

from leo_diffmodel.bags.contents import load
from leo_msgs_py.errors import UserError


def counts(bag: Path) -> dict[str, int]:
    """How many messages of each topic are on disk; nothing before the first."""
    try:
        return {name: len(topic.messages) for name, topic in load(bag).topics.items()}
    except UserError:
        return {}


def states(bag: Path) -> int:
    """How many joint states are on disk."""
    return counts(bag).get('/joint_states', 0)
