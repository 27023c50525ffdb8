# SPDX-License-Identifier: Apache-2.0
"""Chunks that are not what was written are left out, counted, and cost no more than they hold."""

from pathlib import Path
import struct
import subprocess
import sys
import zlib

from mcap.writer import CompressionType
import numpy as np
import pytest
from tests.messages import bag_of, states
from tests.simulate import PENDULUM
import zstandard

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.types import JOINT_STATE
from leo_msgs_py.bag_contents import load
from leo_msgs_py.cli import main
from leo_msgs_py.mcap_file import LARGEST_CHUNK

FRAME = struct.Struct('<BQ')
CHUNK = 6
PAGE = 4096
MIB = 1 << 20


def write(folder: Path, compression=CompressionType.NONE, crc: bool = True) -> Path:
    t = 0.01 * np.arange(400)[:, None]
    swing = states(400, ['pivot'], np.sin(t), np.cos(t))
    return bag_of(folder, *swing, chunk_size=2000, compression=compression, enable_crcs=crc)


def chunks(content: bytes) -> list[int]:
    found, at = [], 8
    while at + FRAME.size < len(content):
        opcode, length = FRAME.unpack_from(content, at)
        if opcode == CHUNK:
            found.append(at)
        at += FRAME.size + length
    return found


def positions(path: Path) -> np.ndarray:
    return np.concatenate([e.q[:, 0] for e in read_bag(path, PENDULUM).episodes])


@pytest.mark.parametrize('kind', CompressionType)
@pytest.mark.parametrize('place', [0, 7, -1])
def test_a_flipped_bit_costs_its_chunk_and_is_counted(kind, place, tmp_path):
    whole, file = write(tmp_path, kind), tmp_path / 'flipped.mcap'
    content = bytearray(whole.read_bytes())
    start = chunks(content)[place]
    _, length = FRAME.unpack_from(content, start)
    content[start + FRAME.size + length // 2] ^= 0x40
    file.write_bytes(content)
    assert load(file).damaged == 1
    kept, all_of_it = positions(file), positions(whole)
    assert len(all_of_it) - 25 <= len(kept) < len(all_of_it)
    assert np.isin(kept, all_of_it).all()
    assert sum('damaged in 1 places' in text for text in read_bag(file, PENDULUM).warnings) == 1


def test_a_chunk_without_a_checksum_is_read(tmp_path):
    file = write(tmp_path, CompressionType.ZSTD, crc=False)
    assert load(file).damaged == 0 and len(positions(file)) == 400


@pytest.mark.parametrize('pages', [1, 5])
@pytest.mark.parametrize('finished', [True, False])
def test_info_of_a_bag_with_zeroed_pages(pages, finished, tmp_path, capsys):
    file = write(tmp_path)
    content = bytearray(file.read_bytes())
    content[2 * PAGE : (2 + pages) * PAGE] = bytes(pages * PAGE)
    file.write_bytes(content if finished else content[: len(content) * 3 // 4])
    assert main(['bag', 'info', str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert 'damaged' in out and err == ''


def test_info_of_a_bag_whose_states_do_not_decode(tmp_path, capsys):
    bag_of(tmp_path, *(('/joint_states', JOINT_STATE, k, b'\0\1\0\0rubbish') for k in range(10)))
    assert main(['bag', 'info', str(tmp_path)]) == 0
    assert '/joint_states' in capsys.readouterr().out


def chunk_record(compression: str, data: bytes, declared: int) -> bytes:
    name = compression.encode()
    content = struct.pack('<QQQI', 0, 1, declared, zlib.crc32(b'')) + struct.pack('<I', len(name))
    content += name + struct.pack('<Q', len(data)) + data
    return FRAME.pack(CHUNK, len(content)) + content


@pytest.mark.parametrize('compression', ['zstd', 'lz4'])
@pytest.mark.parametrize(('filled', 'most'), [(MIB, 100 * MIB), (2 * LARGEST_CHUNK, 400 * MIB)])
def test_a_chunk_costs_what_it_holds_not_what_it_declares(compression, filled, most, tmp_path):
    import lz4.frame

    pack = zstandard.compress if compression == 'zstd' else lz4.frame.compress
    record = chunk_record(compression, pack(bytes(filled)), 1 << 31)
    file = write(tmp_path)
    content = file.read_bytes()
    file.write_bytes(content[:8] + record + content[8:])
    code = (
        'import resource, sys\n'
        'from pathlib import Path\n'
        'from leo_msgs_py.bag_contents import load\n'
        'before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n'
        'contents = load(Path(sys.argv[1]))\n'
        'print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before,\n'
        '      contents.damaged, contents.message_count)\n'
    )
    words = [sys.executable, '-c', code, str(file)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    grown, damaged, messages = map(int, done.stdout.split())
    assert (damaged, messages) == (1, 400)
    assert grown * 1024 < most
