# SPDX-License-Identifier: Apache-2.0
"""A robot folder as somebody may send it: its names are made to run, wherever they are text."""

from html.parser import HTMLParser
import json
from pathlib import Path
from xml.sax.saxutils import quoteattr

from tests.simulate import TORQUE

RUNS = '"""+str(__import__("pathlib").Path("ran").touch())+"""'
"""Runs in a Python file: a file `ran` is there."""
SHELL = '$(touch ran)`touch ran`; touch ran #\'"'
"""Runs in a shell."""
HTML = '"><evil onx=y>\'</script></title><evil>$$x$$ $y$'
"""Makes a tag of its own in HTML, in an attribute, in a script; and is a formula."""


def folder_of(path: Path, joint: str, robot: str = 'torque_pendulum') -> Path:
    """The torque pendulum as a folder, its joint and itself renamed."""
    path.mkdir(parents=True)
    for name, quote in (('robot.yaml', json.dumps), ('robot.urdf', quoteattr)):
        text = (TORQUE.folder / name).read_text()
        for old, new in (('pivot', joint), ('torque_pendulum', robot)):
            text = text.replace(old if quote is json.dumps else f'"{old}"', quote(new))
        (path / name).write_text(text)
    return path


class Tags(HTMLParser):
    """Fails on a tag or an attribute that a name has made."""

    def handle_starttag(self, tag: str, attrs: list) -> None:
        """See that it is none of ours."""
        assert tag != 'evil' and 'onx' not in dict(attrs), (tag, attrs)


def check_html(text: str) -> None:
    """See that no name of HTML has become a tag or an attribute."""
    tags = Tags()
    tags.feed(text)
    tags.close()
