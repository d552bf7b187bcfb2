"""Stages that go on without what cannot be made: they are told what failed; others end as they always did."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import toys
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.errors import InputError
from rgspipe.graph.pipeline import run
from rgspipe.stages.base import Need, Stage


@pytest.fixture
def config(tmp_path: Path) -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {"stage": "gather", "outputs": str(tmp_path / "outputs")})


def _gathering(*needs: Need) -> Callable[[str], Stage]:
    return (toys.STAGES | {"gather": replace(toys.GATHER, inputs=lambda config: needs)}).__getitem__


def test_what_fails_is_told_in_its_place_and_the_rest_is_made(config: RgspipeConfig) -> None:
    text = run(config, toys.load).file("gathered.txt").read_text()
    assert text.splitlines() == [
        "5",
        "break: seed 1 breaks in two lines",
        "6",
        "break: seed: expected another one, found 2. Choose another.",
    ]


def test_what_was_made_before_a_kill_is_not_made_again(config: RgspipeConfig) -> None:
    """The rooms of a study that was killed: `after` with seed 5 is there already."""
    made = run(with_changes(config, {"stage": "after", "seed": 5}), toys.load)
    run(config, toys.load)
    assert run(with_changes(config, {"stage": "after", "seed": 5}), toys.load).manifest == made.manifest


def test_a_need_that_may_not_fail_ends_the_run(config: RgspipeConfig) -> None:
    with pytest.raises(RuntimeError, match="seed 1 breaks"):
        run(config, _gathering(Need("after", {"seed": 2}, may_fail=True), Need("after", {"seed": 1})))


def test_what_is_needed_elsewhere_may_not_fail(config: RgspipeConfig) -> None:
    """The same artifact, once as something that may fail and once as something that may not."""
    with pytest.raises(InputError, match="expected another one"):
        run(config, _gathering(Need("after", {"seed": 2}, may_fail=True), Need("break", {"seed": 2})))


def test_a_full_disk_ends_the_run(config: RgspipeConfig) -> None:
    with pytest.raises((OSError, InputError), match=r"space|full"):
        run(config, _gathering(Need("after", {"seed": toys.FULL}, may_fail=True)))
    assert not (Path(config.outputs) / "cornell" / "gather" / "latest").exists()
