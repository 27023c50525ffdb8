# SPDX-License-Identifier: Apache-2.0
"""A section of the page: a template, the values it shows and its figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Section:
    """One part of a report.

    Attributes:
        template: file in templates/; it gets `values`, and `plots`, the figures as HTML.
        values: what the template shows.
        figures: bokeh figures in the order the template places them.
    """

    template: str
    values: Mapping[str, Any] = field(default_factory=dict)
    figures: tuple[Any, ...] = ()
