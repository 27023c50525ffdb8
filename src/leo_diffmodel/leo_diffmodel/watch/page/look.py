# SPDX-License-Identifier: Apache-2.0
"""What the parts of the page share: colours, words, legends, and how they follow the state."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from bokeh.layouts import column, row
from bokeh.models import Button, ColumnDataSource, Div
from markupsafe import escape, Markup
import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.page import template
from leo_diffmodel.watch.view import MODELS

ROBOTS = ('measured', palette.MEASURED), *((name, stroke) for _, stroke, name in MODELS)
WIDE: dict[str, Any] = {'sizing_mode': 'stretch_width'}
MAIN, SIDE = 400, 400  # least width of what is drawn beside the catalogue, and width of that [px]
GAP, MARGIN = 12, 14  # between parts, and around them all [px]
PLOT, WORDS = 320, 240  # least widths of a plot, and of sentences, beside another part [px]

TEXT = template('live.css').render()
CARD = template('card.css').render()
WRAP = ':host { flex-wrap: wrap; }'
BESIDE = MAIN + SIDE + GAP + 2 * MARGIN + 20  # with a scrollbar; less wide: one column [px]
AT_SIDE, SCROLLED = (template(f'{n}.css').render(beside=BESIDE) for n in ('side', 'scrolled'))


def card(*parts: Any, stylesheets: Sequence[str] = (), **options: Any) -> Any:
    return column(*parts, stylesheets=[CARD, *stylesheets], **WIDE, **options)


def wrapped(*parts: tuple[Any, int], **options: Any) -> Any:
    """Parts side by side where each has at least so many pixels, else below each other."""
    for part, least in parts:
        part.styles = {'min-width': f'min({least}px, 100%)', **part.styles}
    return row(*(part for part, _ in parts), stylesheets=[WRAP], **WIDE, **options)


def said(html: str = '', **options: Any) -> Div:
    """Words on the page: plain ones, or HTML by `Markup`, which escapes the names in it."""
    return Div(text=escape(html), stylesheets=[TEXT], disable_math=True, **options)


def note(words: str) -> Div:
    return said(small(words), **WIDE)


def button(label: str, name: str, *actions: Callable[[], object], **options: Any) -> Button:
    made = Button(label=label, name=name, **options)
    for action in actions:
        made.on_click(action)
    return made


def following(widget: Any, take: Callable[[Any], object], what: str = 'value') -> Any:
    widget.on_change(what, lambda _, __, value: take(value))
    return widget


def small(words: str) -> Markup:
    return Markup('<small>{}</small>').format(words)


def wrong(what: object) -> Markup:
    return Markup('<span class="error">{}</span>').format(what)


def legend(*entries: tuple[str, Stroke]) -> Markup:
    stroke = Markup('<i class="stroke" style="border-color:{};border-top-style:{}"></i>{}')
    each = (stroke.format(s.colour, s.dash, name) for name, s in entries)
    return Markup().join(Markup('<span class="entry">{}</span>').format(one) for one in each)


def renew(source: ColumnDataSource, data: Mapping[str, Any]) -> None:
    """Give a source other columns of numbers; those that it has are not sent and drawn again."""
    if not all(np.array_equal(source.data[name], column) for name, column in data.items()):
        source.data = dict(data)


class Silence:
    """Keeps widgets from acting on the state while they are being set from it."""

    on = False

    def __enter__(self) -> None:
        self.on = True

    def __exit__(self, *_: object) -> None:
        self.on = False
