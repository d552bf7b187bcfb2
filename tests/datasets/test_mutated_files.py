"""Files with bytes changed, cut off or put in are read, finite, or refused by name: nothing else, and at once."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from mutants import mutated, names_place
from readable_files import KINDS, fresh
from rgspipe.errors import InputError

#: Mutants of each kind of file; seeded, so that every run sees the same. `make fuzz` reads many more.
MUTANTS = 40

#: Seconds for one of them; measured: 0.02.
LONGEST = 5.0


@pytest.mark.parametrize("name", KINDS)
def test_a_mutant_is_read_or_refused(tmp_path: Path, name: str) -> None:
    kind, random_ = KINDS[name], random.Random(f"mutants of {name}")
    content = fresh(kind, tmp_path / "case")
    assert list(kind.read(tmp_path / "case")) or name == "manifest"
    refused = 0
    for _ in range(MUTANTS):
        (tmp_path / "case" / kind.file).write_bytes(mutated(content, random_))
        begin = time.perf_counter()
        try:
            assert all(bool(tensor.isfinite().all()) for tensor in kind.read(tmp_path / "case"))
        except InputError as error:
            assert names_place(str(error), str(tmp_path / "case"))
            refused += 1
        assert time.perf_counter() - begin < LONGEST
    assert refused > 0
