# SPDX-License-Identifier: Apache-2.0
"""Safetensors from a file or a topic that may be damaged, with the texts that go with them."""

import json

from safetensors import SafetensorError
from safetensors.torch import load
import torch
from torch import Tensor

DAMAGE = SafetensorError, KeyError, TypeError, ValueError, RuntimeError, OverflowError
"""What reading something damaged raises."""


def read_tensors(data: bytes) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Tensors and metadata by their names; one of `DAMAGE` where they are none, or not finite."""
    tensors = load(data)
    head = json.loads(data[8 : 8 + int.from_bytes(data[:8], 'little')])
    for name, tensor in tensors.items():
        if not torch.isfinite(tensor).all():
            raise ValueError(f'{name} has numbers that are none')
    return tensors, head.get('__metadata__', {})
