# SPDX-License-Identifier: Apache-2.0
"""How the page looks: the report's colours, and the strokes of the three robots."""

from __future__ import annotations

from leo_diffmodel.report import palette
from leo_diffmodel.report.canvas import FONT
from leo_diffmodel.report.palette import Stroke

MEASURED = Stroke(palette.INK, 'solid')
GIVEN = Stroke(palette.BEFORE, 'dashed')
REPAIRED = Stroke(palette.AFTER, 'solid')
SIDE = 400
"""Width of the catalogue [px]."""

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{{ title }}</title>
<style>
html, body { margin: 0; height: 100%; background: #f4f6f8; }
</style>
{{ bokeh_js }}
{{ bokeh_css }}
</head>
<body>
{{ plot_div }}
{{ plot_script }}
</body>
</html>
"""

TEXT = f"""
:host {{ font: 14px/1.4 {FONT}; color: {palette.INK}; }}
b.big {{ font-size: 22px; font-weight: 650; }}
small, .muted {{ color: {palette.MUTED}; }}
.error {{ color: #8f3d00; }}
code {{ font: 12.5px ui-monospace, Menlo, Consolas, "DejaVu Sans Mono", monospace;
  overflow-wrap: anywhere; }}
i.stroke {{ display: inline-block; width: 26px; height: 0; border-top: 3px solid;
  vertical-align: middle; margin: 0 6px 0 14px; }}
i.stroke:first-child {{ margin-left: 0; }}
a {{ color: {palette.AFTER}; margin-right: 14px; }}
"""

CARD = f"""
:host {{ background: #fff; border: 1px solid {palette.GRID}; border-radius: 10px;
  padding: 12px 14px; box-sizing: border-box; }}
"""


def legend(*entries: tuple[str, Stroke]) -> str:
    """Names with their strokes, as HTML."""
    styles = {'solid': 'solid', 'dashed': 'dashed', 'dotdash': 'dashed', 'dotted': 'dotted'}
    return ''.join(
        f'<i class="stroke" style="border-color:{s.colour};border-top-style:{styles[s.dash]}"></i>'
        f'{name}' for name, s in entries
    )  # fmt: skip
