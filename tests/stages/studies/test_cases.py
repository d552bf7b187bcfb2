"""Cases of a study are checked against the configuration before anything is made."""

from __future__ import annotations

import pytest

from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.errors import InputError
from rgspipe.stages.studies.cases import LISTED, checked_cases, chosen_scenes, parse_case


def _changes(*texts: str) -> list[dict[str, object]]:
    return [case.changes for case in checked_cases(with_changes(RgspipeConfig(), {"study.cases": texts}))]


def test_a_value_means_the_artifact_that_it_means_on_the_command_line() -> None:
    text = "target_capture.exposure=1 light.count=null model_error.missing=[0,0,0,1,1,1]"
    (changes,) = _changes(text)
    assert type(changes["target_capture.exposure"]) is float and changes["light.count"] is None
    assert with_changes(RgspipeConfig(), {"stage": "freeze"} | changes) == compose_config(
        ["stage=freeze", *text.split()]
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("target_capture.nose=0.1", "target_capture.noise"),
        ("target_capture=0.1", "no key target_capture"),
        ("target_capture.noise=much", "a number, found much"),
        ("target_capture.noise=-1", "target_capture.noise.*from 0 to 10"),
        ("model_error.missing=[0,1]", "6 values"),
        ("outputs=elsewhere", "how the study is run"),
        ("study.limit=3", "how the study is run"),
    ],
)
def test_what_is_no_setting_is_refused_with_the_case(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        _changes(text)
    assert LISTED in str(caught.value) and text in str(caught.value)


def test_two_cases_of_one_name_are_refused() -> None:
    with pytest.raises(InputError, match="twice"):
        _changes("clean", "clean: seed=1")


def test_scenes_are_those_that_are_named_or_the_one_that_is_configured() -> None:
    config = with_changes(RgspipeConfig(), {"scene.name": "mine"})
    assert [(changes, one.scene.name) for changes, one in chosen_scenes(config)] == [({}, "mine")]
    several = with_changes(config, {"study.scenes": ["corner", "room"]})
    found = [(one.scene.kind, one.scene.name) for _, one in chosen_scenes(several)]
    assert found == [("corner", None), ("room", None)]


@pytest.mark.parametrize(
    ("text", "name", "changes"),
    [
        ("clean", "clean", {}),
        (" clean ", "clean", {}),
        ("as it is: clean", "as it is", {}),
        ("capture.depth_noise=0.01", None, {"capture.depth_noise": 0.01}),
        ("capture.views=25  capture.normals=false", None, {"capture.views": 25, "capture.normals": False}),
        ("capture.views=null", None, {"capture.views": None}),
        ("box gone: model_error.missing=[0,0,-0.5,1,1,0]", "box gone", {"model_error.missing": [0, 0, -0.5, 1, 1, 0]}),
        ("fit.truth=a:b.json", None, {"fit.truth": "a:b.json"}),
        ("noise=3 %: target_capture.noise=3e-2", "noise=3 %", {"target_capture.noise": 0.03}),
        ("model_error.missing=[0, 0, -0.5] seed=3", None, {"model_error.missing": [0, 0, -0.5], "seed": 3}),
        ("scene.name='my room' seed=3", None, {"scene.name": "my room", "seed": 3}),
    ],
)
def test_a_case_is_what_it_says(text: str, name: str | None, changes: dict) -> None:
    found = parse_case(text)
    assert found.name == (name or " ".join(text.split())) and found.changes == changes
    assert [type(value) for value in found.changes.values()] == [type(value) for value in changes.values()]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "noise",
        "depth_noise=",
        "=3",
        "clean capture.depth_noise=0.1",
        "named:",
        ": capture.views=3",
        "model_error.missing=[0,1",
        "seed=1,2",
        "+seed=1",
        "~seed",
    ],
)
def test_a_case_that_says_nothing_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"study\.cases"):
        parse_case(text)
