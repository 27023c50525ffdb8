# SPDX-License-Identifier: Apache-2.0
"""The column maps that come with the package, by their names."""

from pathlib import Path


def shipped_maps() -> dict[str, Path]:
    folder = Path(__file__).parents[1] / 'maps'
    return {path.stem: path for path in sorted(folder.glob('*.yaml'))}
