# SPDX-License-Identifier: Apache-2.0
"""Tensors in a file: whole or not at all, and a full disk is an OSError as anywhere."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from safetensors.torch import save
from torch import Tensor

from leo_msgs_py.whole_file import write_whole


def save_tensors(
    path: Path, tensors: dict[str, Tensor], metadata: Mapping[str, str] | None = None
) -> None:
    """Write a safetensors file in the place of the one that is there.

    Raises:
        OSError: it cannot be written, naming the file; the one before stays.
    """
    write_whole(path, save(tensors, dict(metadata) if metadata else None))
