# SPDX-License-Identifier: Apache-2.0
"""Logs are text in UTF-8, UTF-16 or the Windows encoding, told by their bytes, or refused."""

import codecs

import pytest

from leo_diffmodel.bags.importing.log_format import encoding_of, read_log_text
from leo_msgs_py.errors import UserError

TEXT = 'Zeit [s];Winkel [°]\n0,00;1,5\n0,01;1,6\n'


@pytest.mark.parametrize(
    ('raw', 'encoding'),
    [
        (TEXT.encode('utf-8'), 'utf-8'),
        (TEXT.encode('utf-8-sig'), 'utf-8-sig'),
        (TEXT.encode('cp1252'), 'cp1252'),
        (TEXT.encode('utf-16'), 'utf-16'),
        (codecs.BOM_UTF16_BE + TEXT.encode('utf-16-be'), 'utf-16'),
        (TEXT.encode('utf-16-le'), 'utf-16-le'),
        (TEXT.encode('utf-16-be'), 'utf-16-be'),
    ],
)
def test_the_bytes_say_the_encoding(tmp_path, raw, encoding):
    (tmp_path / 'log.csv').write_bytes(raw)
    assert encoding_of(raw) == encoding
    assert read_log_text(tmp_path / 'log.csv') == TEXT


def test_the_map_may_say_another(tmp_path):
    (tmp_path / 'log.csv').write_bytes(TEXT.encode('cp850'))
    assert read_log_text(tmp_path / 'log.csv', 'cp850') == TEXT


@pytest.mark.parametrize(
    ('raw', 'encoding', 'message'),
    [
        (b'\x81\x8d', None, 'not a text file in cp1252; say the encoding'),
        (b'\xff\x00\x01\x80abc', None, 'not a text file'),
        (b'a', 'latin 17', "no encoding is named 'latin 17'"),
    ],
)
def test_what_is_no_text(tmp_path, raw, encoding, message):
    (tmp_path / 'log.csv').write_bytes(raw)
    with pytest.raises(UserError, match=message):
        read_log_text(tmp_path / 'log.csv', encoding)
