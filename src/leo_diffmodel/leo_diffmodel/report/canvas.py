# SPDX-License-Identifier: Apache-2.0
"""The empty plot that every figure of the pages is drawn on: no frame, a light grid."""

from typing import Any

from bokeh.models import ColumnDataSource, HoverTool, PrintfTickFormatter, Whisker
from bokeh.plotting import figure

from leo_diffmodel.picture import palette

FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif'
HEIGHT, LOW = 290, 230  # of a plot, and of a low one [px]
TOOLS = 'pan,box_zoom,wheel_zoom,reset'


def canvas(x_label: str, y_label: str, **options: Any) -> Any:
    """An empty plot; labels carry their unit, `options` go to bokeh."""
    plot = figure(
        sizing_mode='stretch_width',
        tools=TOOLS,
        active_drag=None,
        active_scroll=None,
        x_axis_label=x_label,
        y_axis_label=y_label,
        toolbar_location='above',
        outline_line_color=None,
        min_border_right=12,
        background_fill_color=palette.PAPER,
        border_fill_color=palette.PAPER,
        **{'height': HEIGHT, **options},
    )
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    plot.grid.grid_line_color = palette.GRID
    plot.axis.axis_label_text_font_style = 'normal'
    plot.axis.axis_label_text_font = plot.axis.major_label_text_font = FONT
    plot.axis.axis_label_text_font_size = plot.axis.major_label_text_font_size = '13px'
    plot.axis.axis_label_text_color = palette.INK
    plot.axis.major_label_text_color = palette.MUTED
    plot.axis.axis_line_color = plot.axis.major_tick_line_color = palette.NOISE
    plot.axis.minor_tick_line_color = None
    return plot


def points(plot: Any, source: ColumnDataSource) -> Any:
    """Points `x`, `y` with whiskers from `low` to `high`; the glyphs of the points."""
    bar = Whisker(base='x', lower='low', upper='high', source=source, line_color=palette.INK)
    for head in (bar.upper_head, bar.lower_head):
        head.update(size=5, line_color=palette.INK)
    plot.add_layout(bar)
    return plot.scatter('x', 'y', source=source, size=7, color=palette.INK, line_color='white')


def hover(plot: Any, glyphs: Any, tips: list[tuple[str, str]]) -> None:
    plot.add_tools(HoverTool(renderers=[glyphs], tooltips=tips))


def plain_numbers(axis: Any) -> None:
    """Numbers on an axis as Python's %g writes them."""
    axis.formatter = PrintfTickFormatter(format='%g')


def ticks(low: float, high: float) -> list[float]:
    """Round numbers on a logarithmic axis: 1, 2, 5 of each decade, or decades on a long one."""
    steps = (1, 2, 5) if high < 300 * low else (1,)
    ticks = [float(f'{m}e{p}') for p in range(-12, 7) for m in steps]
    return [t for t in ticks if 0.99 * low <= t <= 1.01 * high]
