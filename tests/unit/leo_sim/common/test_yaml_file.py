# SPDX-License-Identifier: Apache-2.0
"""YAML files that hold something else than they should: what the message says."""

from pydantic import BaseModel
import pytest

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import read


class Inside(BaseModel):
    value: float


class File(BaseModel):
    inside: Inside
    by_name: dict[str, float] = {}


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('', 'expected a mapping of inside, by_name, found nothing'),
        ('- 1', r'expected a mapping of inside, by_name, found \[1\]'),
        ('{inside: {value: 1}, inside: {value: 2}}', "no.*YAML.*'inside' is there twice"),
        ('# long\n' * 100_000, '700000 characters, more than the 300000 of any file here'),
        ('inside: 0.1', 'inside: must be a mapping of keys to values, found 0.1'),
        ('{inside: {value: 1}, by_name: []}', 'by_name: must be a mapping .*, found '),
    ],
)
def test_what_is_no_mapping_is_said_in_words(tmp_path, text, said):
    path = tmp_path / 'file.yaml'
    path.write_text(text)
    with pytest.raises(UserError, match=said):
        read(path, File)
