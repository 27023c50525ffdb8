# SPDX-License-Identifier: Apache-2.0
"""How a log is to be read, before it is said what its columns are: a part of the column map."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class LogFormat(BaseModel):
    """What a log's own name and text do not say.

    Attributes:
        format: by default what the name ends in; a folder is a LeRobot data set.
        delimiter: of CSV columns; by default what parts all lines alike.
        decimal: the decimal sign of CSV numbers; by default what the numbers show.
        encoding: of text; by default UTF-8, UTF-16 or cp1252, as the bytes show.
        header: names of the columns of a CSV file, of rows that are lists, or of the one matrix
            of a MATLAB file; by default those of the file, else 0, 1, ...
        records: JSON, where the list of rows is, or several such places, an episode each.
        fields: JSON and MATLAB, where arrays are, by the name that the column shall have.
    """

    model_config = ConfigDict(extra='forbid', frozen=True)

    format: Literal['csv', 'json', 'mat'] | None = None
    delimiter: str | None = Field(default=None, min_length=1, max_length=1)
    decimal: Literal['.', ','] | None = None
    encoding: str | None = None
    header: list[str] | None = None
    records: str | list[str] | None = None
    fields: dict[str, str | list[str]] = {}
