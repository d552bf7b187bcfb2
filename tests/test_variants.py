"""`latest` is what the plain command makes; everything else is called by the settings that make it another one."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import toys
from rgspipe.artifacts import ArtifactStore, Key
from rgspipe.cli.compose import compose_config, plain_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.pipeline import resolve, run
from rgspipe.variants import LONGEST, variant_name


@pytest.mark.parametrize(
    ("overrides", "changes", "keys", "name"),
    [
        (["stage=freeze", "freeze.surfels=truth"], {}, ["freeze", "train"], "freeze.surfels=truth"),
        (["fit=paper_adam", "views.count=3"], {}, ["fit.method", "views"], "fit=paper_adam,views.count=3"),
        (["fit=paper_adam", "views.count=3"], {}, ["views.count"], "views.count=3"),
        (["scene=corner", "scene.corner.width=0.3", "outputs=o"], {}, ["scene.corner"], ""),
        (
            ["experiment=smoke", "seed=3"],
            {"freeze.surfels": "truth"},
            ["freeze"],
            "experiment=smoke,freeze.surfels=truth",
        ),
        (["freeze.surfels=trained"], {"freeze.surfels": "truth"}, ["freeze"], "freeze.surfels=truth"),
        (["fit.target=/data/a b"], {}, ["fit.target"], "fit.target=_data_a_b"),
    ],
)
def test_a_variant_is_called_by_what_matters(
    overrides: list[str], changes: dict[str, str], keys: list[str], name: str
) -> None:
    assert variant_name(overrides, changes, keys) == name


@given(st.lists(st.text(min_size=1, max_size=60), max_size=6))
def test_any_name_is_one_of_a_file(values: list[str]) -> None:
    name = variant_name([f"a.k{index}={value}" for index, value in enumerate(values)], {}, ["a"])
    assert "/" not in name and "\0" not in name and len(name) <= LONGEST


@pytest.fixture
def plain(tmp_path: Path) -> RgspipeConfig:
    return with_changes(RgspipeConfig(stage="grow", outputs=str(tmp_path)), {"dataset.resolution": 8})


def links(tmp_path: Path, stage: str) -> dict[str, str]:
    return {path.name: path.resolve().name for path in (tmp_path / "cornell" / stage).glob("latest*")}


def fingerprint(config: RgspipeConfig) -> str:
    return resolve(config, toys.load).key.fingerprint


def test_a_variant_leaves_latest_where_it_is(plain: RgspipeConfig, tmp_path: Path) -> None:
    three = with_changes(plain, {"views.count": 3})
    run(plain, toys.load, [], plain)
    run(three, toys.load, ["views.count=3"], plain)
    expected = {"latest": fingerprint(plain), "latest-views.count=3": fingerprint(three)}
    assert links(tmp_path, "grow") == expected
    assert list(links(tmp_path, "sow")) == ["latest"]


def test_the_plain_command_takes_latest_back(plain: RgspipeConfig, tmp_path: Path) -> None:
    changed = with_changes(plain, {"dataset.resolution": 9})
    for config in (plain, changed, plain):
        run(config, toys.load, [], config)
        assert links(tmp_path, "grow") == {"latest": fingerprint(config)}


def test_what_a_stage_asks_of_its_inputs_are_variants(plain: RgspipeConfig, tmp_path: Path) -> None:
    harvest = with_changes(plain, {"stage": "harvest", "report.views": [1, 2]})
    run(harvest, toys.load, [], harvest)
    assert set(links(tmp_path, "grow")) == {"latest", "latest-views.count=2"}
    assert set(links(tmp_path, "harvest")) == {"latest"}


def test_the_newest_is_what_was_asked_for_last(plain: RgspipeConfig, tmp_path: Path) -> None:
    three = with_changes(plain, {"views.count": 3})
    for config in (plain, three, plain, three):
        run(config, toys.load, ["views.count=3"], plain)
        assert ArtifactStore(tmp_path).newest("cornell", "grow").fingerprint == fingerprint(config)
    assert ArtifactStore(tmp_path).newest("cornell", "reap") is None
    assert Key("cornell", "grow", fingerprint(plain)) == resolve(plain, toys.load).key


def test_a_plain_command_keeps_its_scene() -> None:
    overrides = ["stage=freeze", "scene=corner", "scene.corner.width=0.3", "freeze.surfels=truth", "experiment=smoke"]
    plain, config = plain_config(overrides), compose_config(overrides)
    assert plain.scene == config.scene and plain.stage == "freeze"
    assert (plain.freeze.surfels, plain.dataset.resolution) == ("trained", 128)
