# SPDX-License-Identifier: Apache-2.0
"""NumPy files as tables: arrays by their names, structured ones, or one matrix; no pickles."""

from pathlib import Path
from typing import Any

import numpy as np

from .arrays_log import are_columns, reader
from .log_format import opened


def _content(log: Path) -> Any:
    kind = 'a NumPy file without objects, which can run code; np.savez(FILE, t=t, q=q) makes one'
    with opened(log, kind) as file:
        content = np.load(file, allow_pickle=False)
        if not isinstance(content, np.ndarray):
            content = {name: array[()] for name, array in content.items()}
        elif content.dtype.names:
            content = {name: content[name] for name in content.dtype.names}
        elif are_columns(content.shape):
            content = content.reshape(len(content), -1).tolist()
    return content


NUMPY = reader('numpy', ('npz', 'npy'), _content)
