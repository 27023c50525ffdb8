# SPDX-License-Identifier: Apache-2.0
"""What happens to files on their way: cut, flipped, zeroed, swapped, mistyped. By seed."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import copy
from dataclasses import dataclass
import json
from pathlib import Path
import resource
import shutil
from typing import Any
from xml.etree import ElementTree

import numpy as np
import yaml

from leo_msgs_py.errors import UserError

Rng = np.random.Generator
JUNK: tuple[Any, ...] = (
    *(None, True, -1, 0, 1e308, -1e308, 1e-320, float('nan'), float('inf'), 10**400),
    *('', ' ', '-', 'N m', 'kg', 'pivot', '/', '../..', 'x' * 500),
    *([], {}, [1], [2, 1], [1, 2, 3], {'a': 1}, {'value': 1}),
    *({'value': 'two', 'unit': 'V'}, {'value': 1e300, 'unit': 'N m'}, [None], [[[]]]),
)
TEXTS = (
    *('', ' ', '\n', '---', '[', '{', '- a\n- b\n', ':', '\t', 'a: b: c', '? [a]'),
    *('&a [*a]', '!!python/object:os.system x', '2001-99-99', '0b', '!!binary x', '[' * 3000),
    *('{a: ' * 2000, '&a {<<: *a}'),
    'a: &a [x,x]\nb: &b [*a,*a]\nc: &c [*b,*b]\nd: [*c,*c]',
    *('\ufeff', '%YAML 9.9', "'", '"\\xZZ"', 'robot: ' + '9' * 5000, 'null', '3'),
    'robot: {robot: {robot: pendulum}}',
)
WORDS = ('', 'x', 'nan', 'inf', '-1', '1e308', '0 0', '0 0 0', '1 2 3 4', 'é', '-0', '1e-320')


@dataclass(frozen=True)
class Damage:
    """What was done to a file."""

    what: str  # in words
    start: int  # bytes before this one are as they were


def one_line(read: Callable[[], Any]) -> None:
    """Do something that works, or says in one line what is wrong."""
    said = 'nothing wrong'
    try:
        read()
    except UserError as error:
        said = str(error)
    assert '\n' not in said and 0 < len(said) < 3000, said[:3000]


def damage_bytes(path: Path, rng: Rng) -> Damage:
    """Do to a file what disks, cables and people do."""
    name, change = list(CHANGES.items())[rng.integers(len(CHANGES))]
    content = path.read_bytes()
    start = int(rng.integers(len(content))) if content else 0
    length = int(min(2 ** rng.uniform(0, 16), len(content) - start))
    path.write_bytes(change(content, start, length, rng))
    return Damage(f'{name} {length} bytes at {start} of {path.name}', start)


def _flip(content: bytes, start: int, _: int, rng: Rng) -> bytes:
    changed = bytearray(content)
    changed[start] ^= 1 << int(rng.integers(8))
    return bytes(changed)


CHANGES: dict[str, Callable[[bytes, int, int, Rng], bytes]] = {
    'cut': lambda content, start, length, rng: content[:start],
    'flip': _flip,
    'zero': lambda content, start, n, rng: content[:start] + bytes(n) + content[start + n :],
    'noise': lambda content, start, n, rng: content[:start] + rng.bytes(n) + content[start + n :],
    'insert': lambda content, start, n, rng: content[:start] + rng.bytes(n) + content[start:],
    'remove': lambda content, start, n, rng: content[:start] + content[start + n :],
    'repeat': lambda content, start, n, rng: content[: start + n] + content[start:],
}


def damage_path(path: Path, rng: Rng) -> Damage:
    """Put something else where a file was."""
    name = OTHERS[rng.integers(len(OTHERS))]
    path.unlink()
    if name == 'a folder':
        path.mkdir()
    elif name == 'a loop':
        other = path.with_name(f'{path.name}.loop')
        other.symlink_to(path)
        path.symlink_to(other)
    elif name in ('nowhere', '/dev/null'):
        path.symlink_to(name)
    elif name == 'empty':
        path.touch()
    elif name == 'another file':
        shutil.copy(__file__, path)
    return Damage(f'{name} in the place of {path.name}', 0)


OTHERS = ('nothing', 'a folder', 'a loop', 'nowhere', 'empty', '/dev/null', 'another file')


def damage_yaml(path: Path, rng: Rng) -> Damage:
    """Mistype a YAML file: a wrong value, a missing, unknown or doubled key, or no YAML."""
    if rng.random() < 0.2:
        text = TEXTS[rng.integers(len(TEXTS))]
        path.write_text(text, encoding='utf-8')
        return Damage(f'{path.name} is {text[:40]!r}', 0)
    content = yaml.safe_load(path.read_text(encoding='utf-8'))
    what = _mistyped(content, rng)
    path.write_text(yaml.safe_dump(content), encoding='utf-8')
    return Damage(f'{path.name}: {what}', 0)


def damage_json(path: Path, rng: Rng) -> Damage:
    """Mistype a JSON file, or do to it what happens to bytes."""
    if rng.random() < 0.3:
        return damage_bytes(path, rng)
    content = json.loads(path.read_text(encoding='utf-8'))
    what = _mistyped(content, rng)
    path.write_text(json.dumps(content), encoding='utf-8')
    return Damage(f'{path.name}: {what}', 0)


def _mistyped(content: Any, rng: Rng) -> str:
    """Change one place of nested lists and mappings."""
    places = list(_places(content))
    parent, key = places[rng.integers(len(places))]
    action = rng.integers(4)
    if action == 0:
        del parent[key]
        return f'without {key!r}'
    if action == 1 and isinstance(parent, dict):
        parent[f'{key}x'] = parent.pop(key)
        return f'{key!r} misspelt'
    if action == 2:
        other_parent, other = places[rng.integers(len(places))]
        parent[key] = copy.deepcopy(other_parent[other])
        return f'{key!r} has what {other!r} has'
    parent[key] = copy.deepcopy(JUNK[rng.integers(len(JUNK))])
    return f'{key!r} is {str(parent[key])[:30]!r}'


def _places(content: Any) -> Any:
    """Yield (container, key) of everything inside."""
    pairs = content.items() if isinstance(content, dict) else enumerate(content)
    for key, value in list(pairs):
        yield content, key
        if isinstance(value, dict | list):
            yield from _places(value)


def damage_xml(path: Path, rng: Rng) -> Damage:
    """Spoil an attribute or an element of an XML file."""
    root = ElementTree.fromstring(path.read_text(encoding='utf-8'))
    elements = [e for e in root.iter() if e.attrib]
    element = elements[rng.integers(len(elements))]
    key = sorted(element.attrib)[rng.integers(len(element.attrib))]
    action = rng.integers(4)
    if action == 0:
        del element.attrib[key]
    elif action == 1:
        element.set(key, WORDS[rng.integers(len(WORDS))])
    elif action == 2:
        parent = next(p for p in (root, *root.iter()) if len(p))
        parent.append(copy.deepcopy(element))
    else:
        for parent in root.iter():
            if element in list(parent):
                parent.remove(element)
    path.write_text(ElementTree.tostring(root, encoding='unicode'), encoding='utf-8')
    return Damage(f'{path.name}: <{element.tag} {key}> ({action})', 0)


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file may grow beyond so many bytes, as on a disk with no more room."""
    _, most = limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
