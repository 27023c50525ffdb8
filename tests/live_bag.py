# SPDX-License-Identifier: Apache-2.0
"""What can be read of a bag while it is being recorded."""

from pathlib import Path

from leo_diffmodel.bags.recorder import header_stamp
from leo_msgs_py.bag_contents import BagContents, load
from leo_msgs_py.errors import UserError
from leo_msgs_py.topics import Topic


def contents(bag: Path) -> BagContents | None:
    """What is on disk, None before the first message."""
    try:
        return load(bag)
    except UserError:
        return None


def counts(bag: Path) -> dict[str, int]:
    """How many messages of each topic are on disk; nothing before the first."""
    found = contents(bag)
    return {name: len(log.messages) for name, log in found.topics.items()} if found else {}


def has(bag: Path, *topics: Topic) -> bool:
    """Whether something of each topic is on disk."""
    found = counts(bag)
    return all(found.get(f'/{topic.name}') for topic in topics)


def newest(bag: Path, topic: Topic) -> int:
    """Stamp [ns] of the last message on disk of a topic with stamps, -1 before the first."""
    found = contents(bag)
    log = found.topics.get(f'/{topic.name}') if found else None
    return header_stamp(log.messages[-1].data) if log and log.messages else -1


def says(bag: Path, fact: str) -> bool:
    """Whether the bag names a fact about its robot already."""
    found = contents(bag)
    return found is not None and fact in found.metadata.get('leo', {})
