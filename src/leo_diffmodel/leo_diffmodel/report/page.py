# SPDX-License-Identifier: Apache-2.0
"""report.html: one file that needs no network, assembled from sections."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from bokeh.document import Document
from bokeh.embed import components
from bokeh.resources import Resources
import jinja2
from markupsafe import Markup

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report import text
from leo_diffmodel.report.canvas import FONT

Row = Mapping[str, Any]  # of a JSON


@dataclass(frozen=True)
class Section:
    """A part of a report: a file in templates/ with its values, and bokeh figures, its `plots`."""

    template: str
    values: Mapping[str, Any] = field(default_factory=dict)
    figures: tuple[Any, ...] = ()


def models(*strokes: Stroke) -> list[tuple[str, Stroke]]:
    names = ('as given', 'repaired') if len(strokes) > 1 else ('the model',)
    return list(zip(names, strokes, strict=True))


def render(title: str, source: str, sections: Sequence[Section], watch: str = '') -> str:
    """The page as HTML; bokeh's script is included only where there is a figure.

    `source` names the data, `watch` the command that opens the live page on them ('' names none).
    """
    figures = [f for s in sections for f in s.figures]
    document = Document()
    with document.models.freeze():  # one by one, each would walk all the others again
        for figure in figures:
            document.add_root(figure)
    script, divs = components(figures) if figures else ('', ())
    remaining = iter(divs)
    blocks = []
    for section in sections:
        plots = [next(remaining) for _ in section.figures]
        blocks.append(template(section.template).render(section.values, plots=plots))
    library = Resources(mode='inline', components=['bokeh']).render_js() if figures else ''
    return template('page.html').render(
        title=title, source=source, sections=blocks, library=library, script=script, watch=watch
    )


def template(name: str) -> jinja2.Template:
    return _templates().get_template(name)


@cache
def _templates() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader('leo_diffmodel.report'),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    for name in ('number', 'percent', 'prose', 'quantity'):
        environment.filters[name] = getattr(text, name)
    environment.globals |= {'palette': palette, 'font': Markup(FONT)}
    return environment
