# SPDX-License-Identifier: Apache-2.0
"""A robot without some of its links, as without its gripper."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar
from xml.etree import ElementTree

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.verbs.skeleton.description import Description

Value = TypeVar('Value')


def without(description: Description, links: Sequence[str], source: str) -> Description:
    """The description less these links, their joints and everything beyond them.

    Raises:
        UserError: No such link, the root, or a joint that stays mimics one that goes.
    """
    root = ElementTree.fromstring(description.text)
    joints = root.findall('joint')
    known = [link.get('name', '') for link in root.findall('link')]
    for link in links:
        _check(link, known, joints, source)
    gone = _beyond(set(links), joints)
    lost = {joint.get('name', '') for joint in joints if _end(joint, 'child') in gone}
    _check_copies(joints, lost, source)
    for element in list(root):
        name = element.get('name')
        if (element.tag == 'link' and name in gone) or (element.tag == 'joint' and name in lost):
            root.remove(element)
    motors = description.motors
    note = (
        f'{", ".join(n for n in known if n in gone)} left out with '
        f'{", ".join(j.get("name", "") for j in joints if j.get("name") in lost)}'
    )
    return replace(
        description,
        text=ElementTree.tostring(root, encoding='unicode') + '\n',
        frictions=_kept(description.frictions, lost),
        springs=_kept(description.springs, lost),
        motors=None if motors is None else motors - lost,
        notes=(*description.notes, note),
    )


def _check(
    link: str, known: Sequence[str], joints: Sequence[ElementTree.Element], source: str
) -> None:
    if link not in known:
        child = next((_end(j, 'child') for j in joints if j.get('name') == link), '')
        hint = f'; it is a joint, whose link is {child!r}' if child else nearest(link, known)
        raise UserError(f'--without: {source} has no link {link!r}{hint}')
    if link not in {_end(joint, 'child') for joint in joints}:
        raise UserError(f'--without: {link!r} is the root of {source}; nothing would be left')


def _check_copies(joints: Sequence[ElementTree.Element], lost: set[str], source: str) -> None:
    for joint in joints:
        copied = joint.find('mimic')
        if copied is not None and copied.get('joint') in lost and joint.get('name') not in lost:
            raise UserError(
                f'{source}: joint {joint.get("name")!r} mimics '
                f'{copied.get("joint")!r}, which --without takes out; take it out '
                f'too: --without {_end(joint, "child")}'
            )


def _beyond(gone: set[str], joints: Sequence[ElementTree.Element]) -> set[str]:
    """These links and all that hang on them."""
    while more := {_end(j, 'child') for j in joints if _end(j, 'parent') in gone} - gone:
        gone = gone | more
    return gone


def _end(joint: ElementTree.Element, tag: str) -> str:
    found = joint.find(tag)
    return '' if found is None else found.get('link', '')


def _kept(figures: Mapping[str, Value], lost: set[str]) -> dict[str, Value]:
    return {joint: figure for joint, figure in figures.items() if joint not in lost}
