"""JSON is read strictly: whatever could be read in two ways, or end a reader, is an error that names the file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rgspipe.datasets.json_file import read_json, read_json_value
from rgspipe.datasets.ply.cameras import read_viewpoints
from rgspipe.errors import InputError


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"a": ' + "9" * 400 + "}", "400 digits"),
        ('{"a": ' + "9" * 5000 + "}", "5000 digits"),
        ('{"a": 1, "a": 2}', "'a' is there twice"),
        ("[" * 100_000, "nested too deeply"),
        ('{"a": ' + "[" * 100_000, "nested too deeply"),
        ("{", "invalid JSON"),
    ],
    ids=["400 digits", "5000 digits", "twice", "deep list", "deep object", "cut off"],
)
@pytest.mark.parametrize("reader", [lambda path: read_json(path, "a test"), read_viewpoints], ids=["object", "cameras"])
def test_what_is_no_plain_json_is_named(tmp_path: Path, reader, text: str, words: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=rf"a\.json.*{words}"):
        reader(tmp_path / "a.json")


def test_plain_json_comes_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"a": [1, -2.5, 1e300, null, true], "b": {"a": "é"}}')
    assert read_json_value(tmp_path / "a.json", "a test") == {"a": [1, -2.5, 1e300, None, True], "b": {"a": "é"}}


@pytest.mark.parametrize("text", ["NaN", "-Infinity", "1e999", "9" * 309, "true", '"1"'])
def test_what_is_no_finite_number_is_named_with_its_key(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.json").write_text(f'[{{"position": [0, 0, {text}]}}]')
    with pytest.raises(InputError, match=r"a\.json"):
        read_viewpoints(tmp_path / "a.json")


def test_pipes_and_devices_do_not_hold_a_reader_up(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    for path in (tmp_path / "pipe.json", Path("/dev/zero")):
        with pytest.raises(InputError, match="pipe or a device"):
            read_json(path, "a test")
