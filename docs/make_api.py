# SPDX-License-Identifier: Apache-2.0
"""Write docs/reference/api.md from the docstrings of what programs import.

python docs/make_api.py            writes it
python docs/make_api.py --check    exit status 1 where it is not up to date
"""

import itertools
import re
import sys

import griffe
from griffe2md import default_config, render_object_docs
from make_effects import written

MODULES = (
    'leo_diffmodel.api',
    'leo_diffmodel.results',
    'leo_diffmodel.bags.recording',
    'leo_diffmodel.bags.importing.log_format',
    'leo_sim.model.model',
    'leo_sim.model.model_file',
    'leo_sim.effects.base',
    'leo_sim.effects.parameter',
    'leo_sim.drivers.base',
    'leo_msgs_py.errors',
)
HEAD = """# Python reference

What programs import, from its docstrings by `python docs/make_api.py`; a test holds it to them.
[Python](../python.md) shows how it goes together, [contracts](contracts.md) what files and topics
promise.
"""
LINK = re.compile(r'\[([^\[\]]*)\]\(#([\w.]+)\)')
FIELD = re.compile(
    r'^#{4,} `[\w.]+`\n\n```python\n\w+ ?[:=][^`]*```\n(?:(?!#).*\n)*', re.MULTILINE
)
"""A field of a class, which stands in the list of the class already."""
CONFIG = {
    **default_config,
    'heading_level': 2,
    'members_order': 'source',
    'signature_crossrefs': False,
    'summary': {'attributes': True, 'classes': False, 'functions': False, 'modules': False},
    'separate_signature': True,
}


def page() -> str:
    """The whole of api.md; a type that is not on the page is a word and no link."""
    loader = griffe.GriffeLoader(docstring_parser=griffe.Parser.google)
    parts = [render_object_docs(_own(loader.load(name)), CONFIG) for name in MODULES]
    text = FIELD.sub('', '\n\n'.join(part.strip() for part in parts) + '\n')
    here = set(re.findall(r'^#+ `([\w.]+)`', text, re.MULTILINE))
    text = LINK.sub(lambda m: m[0] if m[2] in here else m[1], text)
    return HEAD + '\n' + re.sub(r' – $', '', re.sub(r'\n{3,}', '\n\n', text), flags=re.MULTILINE)


def _own(module: griffe.Module) -> griffe.Module:
    """Without what it imports; a comment beside or above a field is its description."""
    for name in [name for name, member in module.members.items() if member.is_alias]:
        module.del_member(name)
    for kind in module.classes.values():
        for field in kind.attributes.values():
            if not field.docstring and (text := _comment(module.lines, field.lineno - 1)):
                field.docstring = griffe.Docstring(text, parent=field)
    return module


def _comment(lines: list[str], at: int) -> str:
    if beside := lines[at].partition('  # ')[2]:
        return beside
    above = itertools.takewhile(lambda line: line.startswith('    # '), reversed(lines[:at]))
    return ' '.join(line.removeprefix('    # ') for line in reversed(list(above)))


if __name__ == '__main__':
    sys.exit(written({'reference/api.md': page()}, 'reference', sys.argv[1:]))
