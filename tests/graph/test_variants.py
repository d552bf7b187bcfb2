"""`latest` is what the plain command makes; what is made to compare is called by its settings."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import toys
from rgspipe.cli.compose import compose_config, usual_command
from rgspipe.cli.sweep_check import check_sweep
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.graph.pipeline import Usual, run
from rgspipe.graph.resolver import resolve
from rgspipe.graph.variants import LONGEST, variant_name
from rgspipe.store.artifacts import ArtifactStore


@pytest.mark.parametrize(
    ("overrides", "swept", "changes", "keys", "name"),
    [
        (["stage=freeze", "freeze.surfels=truth"], [], {}, ["freeze", "train"], "freeze.surfels=truth"),
        (["dataset.resolution=64", "fit.limit=2"], [], {}, ["dataset", "fit.limit"], ""),
        (["fit=paper_adam", "seed=3"], ["seed"], {}, ["fit.method", "seed"], "fit=paper_adam,seed=3"),
        (["fit=paper_adam", "views.count=3"], ["views.count"], {}, ["views.count"], "views.count=3"),
        (["fit=paper_adam", "views.count=3"], [], {}, ["freeze", "dataset"], ""),
        (["views=multi"], ["views"], {}, ["views.count"], "views=multi"),
        (["seed=3"], [], {"freeze.surfels": "truth"}, ["freeze"], "freeze.surfels=truth"),
        (["freeze.surfels=trained"], [], {"freeze.surfels": "truth"}, ["freeze"], "freeze.surfels=truth"),
        (["fit.target=/data/a b"], ["fit.target"], {}, ["fit.target"], "fit.target=_data_a_b"),
        (["model_error.albedo=0.1"], [], {}, ["model_error"], "model_error.albedo=0.1"),
    ],
)
def test_a_variant_is_called_by_what_varies_and_matters(
    overrides: list[str], swept: list[str], changes: dict[str, str], keys: list[str], name: str
) -> None:
    assert variant_name(overrides, swept, changes, keys) == name


@given(st.lists(st.text(min_size=1, max_size=60), max_size=6))
def test_any_name_is_one_of_a_file(values: list[str]) -> None:
    overrides = [f"a.k{index}={value}" for index, value in enumerate(values)]
    name = variant_name(overrides, [f"a.k{index}" for index in range(len(values))], {}, ["a"])
    assert "/" not in name and "\0" not in name and len(name) <= LONGEST


@pytest.fixture
def plain(tmp_path: Path) -> RgspipeConfig:
    return with_changes(RgspipeConfig(stage="grow", outputs=str(tmp_path)), {"dataset.resolution": 8})


def links(tmp_path: Path, stage: str) -> dict[str, str]:
    return {path.name: path.resolve().name for path in (tmp_path / "cornell" / stage).glob("latest*")}


def fingerprint(config: RgspipeConfig) -> str:
    return resolve(config, toys.load).key.fingerprint


def test_a_job_of_a_sweep_leaves_latest_where_it_is(plain: RgspipeConfig, tmp_path: Path) -> None:
    usual = Usual(plain, frozenset({"views.count"}))
    for count in (3, 1):
        run(with_changes(plain, {"views.count": count}), toys.load, [f"views.count={count}"], usual)
    three = with_changes(plain, {"views.count": 3})
    assert links(tmp_path, "grow") == {"latest": fingerprint(plain), "latest-views.count=3": fingerprint(three)}
    assert list(links(tmp_path, "sow")) == ["latest"]


def test_the_plain_command_takes_latest_back(plain: RgspipeConfig, tmp_path: Path) -> None:
    changed = with_changes(plain, {"dataset.resolution": 9})
    for config in (plain, changed, plain):
        run(config, toys.load, [], Usual(config))
        assert links(tmp_path, "grow") == {"latest": fingerprint(config)}


def test_what_a_stage_asks_of_its_inputs_are_variants(plain: RgspipeConfig, tmp_path: Path) -> None:
    harvest = with_changes(plain, {"stage": "harvest", "report.views": [1, 2]})
    run(harvest, toys.load, [], Usual(harvest))
    assert set(links(tmp_path, "grow")) == {"latest", "latest-views.count=2"}
    assert set(links(tmp_path, "harvest")) == {"latest"}


def test_the_newest_is_what_was_asked_for_last(plain: RgspipeConfig, tmp_path: Path) -> None:
    store, three = ArtifactStore(tmp_path), with_changes(plain, {"views.count": 3})
    for config in (plain, three, plain, three):
        run(config, toys.load, ["views.count=3"], Usual(plain, frozenset({"views.count"})))
        assert store.newest("cornell", "grow").fingerprint == fingerprint(config)
    assert store.newest("cornell", "reap") is None


def test_the_usual_command_is_the_one_without_what_varies() -> None:
    overrides = ["stage=freeze", "scene=corner", "freeze.surfels=truth", "experiment=smoke", "fit.limit=2"]
    sweep = [*overrides, "views.count=2,3", "fit=search_lm,paper_adam", "report.views=[1,3]"]
    usual = usual_command(sweep, check_sweep(sweep))
    assert usual.swept == {"views.count", "fit"}
    expected = compose_config([*overrides, "report.views=[1,3]"])
    assert usual.config == with_changes(expected, {"freeze.surfels": "trained"})


def test_where_nothing_varies_the_usual_command_is_the_command() -> None:
    overrides = ["stage=freeze", "scene=corner", "fit.limit=2"]
    usual = usual_command(overrides, compose_config(overrides))
    assert (usual.config, usual.swept) == (compose_config(overrides), frozenset())
