"""The studies of recovered lights: what they ask for, and what they make of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import get_args

import pandas as pd
import pytest

from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.config.studies import Kind
from rgspipe.datasets.advice_file import own_views_in_order
from rgspipe.errors import InputError
from rgspipe.evaluation.tables import TARGET_COLUMNS
from rgspipe.stages.base import StageContext
from rgspipe.stages.studies import study
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from rgspipe.studies.lights import KINDS

ADVICE = "added,views,camera,position_sd\nalone,2,view_1,0.004\nplan,2,train/r_0,0.001\n"
ADVICE += "in_order,2,view_1,0.004\nin_order,3,view_2,0.003\nin_order,4,train/r_0,0.002\nin_order,5,view_3,0.001\n"


def _config(**changes: object) -> RgspipeConfig:
    named = {f"study.{key}": value for key, value in changes.items()}
    return with_changes(RgspipeConfig(), {"stage": "study", "study.kind": "robustness"} | named)


def _artifact(root: Path, stage: str, fingerprint: str, files: Mapping[str, str]) -> Artifact:
    def build(folder: Path) -> dict:
        for name, text in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text)
        return {}

    recipe = {"config": {}, "inputs": {}, "code": {}}
    return ArtifactStore(root).build(Key("cornell", stage, fingerprint), recipe, build)[0]


def _metrics(views: int, error: float) -> str:
    rows = [
        dict.fromkeys(TARGET_COLUMNS, math.nan)
        | {"target": f"{name}_000", "occlusion": name, "method": "search_lm", "views": views}
        | {"position_error": error, "intensity_error": 0.02, "seconds": 0.5, "success": error < 0.01}
        | {"position_sd": 1.2 * error, "inside_95": True, "result": "converged", "reason": ""}
        for name in ("visible", "occluded")
    ]
    return pd.DataFrame(rows).to_csv(index=False)


def _run(config: RgspipeConfig, lists: Mapping[str, list[Artifact]], folder: Path) -> pd.DataFrame:
    folder.mkdir()
    study.run(StageContext(config, {name: found[0] for name, found in lists.items()}, lists, folder))
    assert (folder / "study.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "study.md").read_text().startswith("| ")
    return pd.read_csv(folder / "study.csv")


def test_a_study_asks_for_every_case_method_and_number_of_views_of_every_scene() -> None:
    cases = ["clean", "noise: target_capture.noise=0.03"]
    config = _config(cases=cases, scenes=["cornell", "corner"], views=[1, 3], methods=["search_lm", "paper_adam"])
    needs = study.STAGE.needs(config)
    assert [need.stage for need in needs] == ["evaluate"] * 16
    assert needs[0].changes["scene.kind"] == "cornell" and needs[8].changes["scene.kind"] == "corner"
    noisy = needs[7].changes
    assert noisy["target_capture.noise"] == 0.03 and noisy["views.count"] == 3 and noisy["fit.method"] == "paper_adam"
    assert noisy["fit.limit"] == 1 and "fit.limit" not in needs[0].changes
    for need in needs:
        with_changes(config, need.changes)


def test_the_fits_of_fewest_views_foretell_the_others() -> None:
    needs = study.STAGE.needs(_config(kind="views", views=[2, 4], methods=["search_lm", "paper_adam"]))
    asked = [(need.stage, need.changes["fit.method"], need.changes["views.count"]) for need in needs]
    assert asked[:3] == [("fit_light", "search_lm", 2), ("evaluate", "search_lm", 2), ("evaluate", "search_lm", 4)]
    assert [bool(need.changes.get("fit.suggest_view")) for need in needs] == [True, True, False, False, False]


def test_every_kind_that_can_be_asked_for_can_be_shown() -> None:
    assert get_args(Kind) == tuple(study.KINDS) == ("captures", "lamps", *KINDS, "courses", "zoo")


def test_a_case_has_the_last_word() -> None:
    (need,) = study.STAGE.needs(_config(cases=["four: views.count=4 fit.limit=2"]))
    assert need.changes["views.count"] == 4 and need.changes["fit.limit"] == 2


def test_a_case_that_is_none_is_refused_before_anything_is_made() -> None:
    with pytest.raises(InputError, match=r"study\.cases.*target_capture\.noise"):
        study.STAGE.needs(_config(cases=["target_capture.nose=0.1"]))


#: Studies that are prepared: their kinds, and on how many cells the paper's method runs.
PREPARED = {
    "light_views": ("views", 3),
    "light_views_corner": ("views", 3),
    "light_robustness": ("robustness", 0),
    "light_classes": ("classes", 0),
    "light_kinds": ("kinds", 0),
    "light_regions": ("regions", 0),
    "light_adam": ("adam", 2),
}


@pytest.mark.parametrize("name", PREPARED)
def test_every_study_that_is_prepared_composes_and_names_its_cases(name: str) -> None:
    config = compose_config(["stage=study", f"experiment={name}"])
    kind, slow = PREPARED[name]
    assert config.study.kind == kind
    needs = study.STAGE.needs(config)
    fits = [need for need in needs if need.stage == "evaluate"]
    searches = [need for need in fits if need.changes["fit.method"] == "search_lm"]
    wanted = config.study
    assert len(searches) == max(1, len(wanted.scenes)) * len(wanted.cases) * len(wanted.views)
    assert len(fits) - len(searches) == slow


def test_the_papers_method_is_compared_on_the_targets_of_the_search() -> None:
    config = compose_config(["stage=study", "experiment=light_adam"])
    fits = [need.changes for need in study.STAGE.needs(config)]
    assert config.fit.limit == 5 and not any("fit.limit" in changes for changes in fits)
    methods = [changes["fit.method"] for changes in fits]
    assert methods == ["search_lm", "paper_adam"] * 2


def test_the_papers_method_has_numbers_of_views_of_its_own() -> None:
    config = compose_config(["stage=study", "experiment=light_views"])
    fits = [need.changes for need in study.STAGE.needs(config) if need.stage == "evaluate"]
    slow = [changes for changes in fits if changes["fit.method"] == "paper_adam"]
    assert [changes["views.count"] for changes in slow] == [1, 4, 8] and len(fits) == 11
    assert all(changes["fit.limit"] == 20 for changes in slow)
    everywhere = _config(views=[1, 2], methods=["paper_adam"])
    assert [need.changes["views.count"] for need in study.STAGE.needs(everywhere)] == [1, 2]


def test_views_are_one_table_with_what_was_foretold(tmp_path: Path) -> None:
    config = _config(kind="views", views=[1, 2, 3])
    evaluated = [
        _artifact(tmp_path, "evaluate", f"{views:02x}", {"metrics.csv": _metrics(views, 0.012 / views)})
        for views in (1, 2, 3)
    ]
    fit = _artifact(tmp_path, "fit_light", "aa", {"visible_000/suggested_views.csv": ADVICE, "results.csv": ""})
    table = _run(config, {"fit_light": [fit], "evaluate": evaluated}, tmp_path / "study")
    assert len(table) == 9 and set(table["kind"]) == {"views"} and set(table["scene"]) == {"cornell"}
    whole = table[table["occlusion"] == "all"].set_index("views")
    assert whole["position"].tolist() == pytest.approx([0.012, 0.006, 0.004])
    assert whole["success"].tolist() == [0.0, 1.0, 1.0]
    assert whole["predicted"].tolist() == pytest.approx([0.0144, 0.004, 0.003])
    assert table.loc[table["occlusion"] == "occluded", "predicted"].isna().all(), "its fit has no advice"
    assert "predicted" in (tmp_path / "study" / "study.md").read_text()


def _cases_of(kind: str) -> Callable[[Path], pd.DataFrame]:
    def made(tmp_path: Path) -> pd.DataFrame:
        evaluated = [
            _artifact(tmp_path, "evaluate", f"{index:02x}", {"metrics.csv": _metrics(1, error)})
            for index, error in enumerate((0.004, 0.02))
        ]
        config = _config(kind=kind, cases=["clean", "noise 3 %: target_capture.noise=0.03"])
        return _run(config, {"evaluate": evaluated}, tmp_path / "study")

    return made


def test_cases_stand_below_each_other(tmp_path: Path) -> None:
    table = _cases_of("robustness")(tmp_path)
    whole = table[table["occlusion"] == "all"].set_index("case")
    assert whole["position"].to_dict() == pytest.approx({"clean": 0.004, "noise 3 %": 0.02})
    text = (tmp_path / "study" / "study.md").read_text()
    assert "| noise 3 % | 1 | 2 | 2.00 % (2.00–2.00) |" in text and "visible" not in text


def test_classes_stand_below_each_other(tmp_path: Path) -> None:
    _cases_of("classes")(tmp_path)
    text = (tmp_path / "study" / "study.md").read_text()
    assert "| clean | 1 | visible | 1 |" in text and "| noise 3 % | 1 | all classes | 2 |" in text


def test_advice_counts_up_to_the_first_camera_of_another_place(tmp_path: Path) -> None:
    (tmp_path / "suggested_views.csv").write_text(ADVICE)
    found = own_views_in_order(tmp_path / "suggested_views.csv")
    assert found.to_dict("list") == {"views": [2, 3], "position_sd": [0.004, 0.003]}
