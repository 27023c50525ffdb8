# SPDX-License-Identifier: Apache-2.0
"""Tensors in a file: whole or not at all, and a full disk is an OSError as anywhere."""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
import re

from safetensors import SafetensorError
from safetensors.torch import save_file
from torch import Tensor


def save_tensors(
    path: Path, tensors: dict[str, Tensor], metadata: Mapping[str, str] | None = None
) -> None:
    """Write a safetensors file in the place of the one that is there.

    Raises:
        OSError: it cannot be written, naming the file; the one before stays.
    """
    partial = path.with_name(f'{path.name}.tmp')
    try:
        save_file(tensors, partial, dict(metadata) if metadata else None)
        partial.replace(path)
    except SafetensorError as error:
        partial.unlink(missing_ok=True)
        number = re.search(r'os error (\d+)', str(error))
        if number is None:
            raise
        raise OSError(int(number[1]), os.strerror(int(number[1])), str(path)) from error
