"""The command line tells what the library says with its own keys."""

from __future__ import annotations

import pytest

from rgspipe.cli.messages import show_input_error
from rgspipe.config import RgspipeConfig
from rgspipe.config.core import describe
from rgspipe.config.spoken import CALLS, as_keys, told_with_keys
from rgspipe.errors import InputError
from rgspipe.fitting.findings import Finding

KEYS = {key for key, _, _ in describe(RgspipeConfig())}

ERROR = {"expected": "same", "found": "CaptureOptions(exposure='free')", "remedy": "Raise PlyOptions.max_surfels."}


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("CaptureOptions.exposure", "lamps.exposure"),
        ("expose alike (CaptureOptions(exposure='same')).", "expose alike (lamps.exposure=same)."),
        ("Raise PlyOptions.max_surfels.", "Raise scene.ply.max_surfels."),
        ("with PlyOptions(crop=[x, y, z, x, y, z]), or", "with scene.ply.crop=[x,y,z,x,y,z], or"),
        ("LightSpec(count=2), or LightSpec(count=None)", "light.count=2, or light.count=null"),
        ("allow for it (LightSpec(ambient=True))", "allow for it (light.ambient=true)"),
        ("Decided by Search.bar.least.", "Decided by fit.search.bar.least."),
        ("raise TrainOptions.memory_mib", "raise train.memory_mib"),
        ("more surfels (surfels=…)", "more surfels (init.surfels)"),
    ],
)
def test_options_are_told_as_keys(said: str, told: str) -> None:
    assert as_keys(said) == told and as_keys(told) == told


@pytest.mark.parametrize("said", ["LightSpec.shape", "CaptureOptions.nothing", "PlyOptions", "MyPlyOptions.crop"])
def test_what_is_no_key_stays_as_it_is(said: str) -> None:
    assert as_keys(said) == said


def test_what_is_told_in_the_place_of_calls_are_keys() -> None:
    told = {word.partition("=")[0] for keys in CALLS.values() for word in keys.replace(",", "").split()}
    assert told - KEYS == {"scene"}  # which scene is a choice of a group, and no key


def test_settings_that_decide_a_fit_s_findings_are_told_as_keys() -> None:
    named = {name for kind in Finding.__subclasses__() for name in kind.__dict__.get("decided_by", ())}
    assert named
    for name in named:
        assert as_keys(f"Search.{name}") == f"fit.search.{name}"


def test_errors_keep_their_parts_and_their_cause() -> None:
    with (
        pytest.raises(InputError, match=r"^scene\.ply\.low: expected same, found lamps\.exposure=free\. Raise") as told,
        told_with_keys(),
    ):
        raise InputError("PlyOptions.low", **ERROR) from KeyError("a")
    assert told.value.where == "scene.ply.low" and told.value.remedy == "Raise scene.ply.max_surfels."
    assert isinstance(told.value.__cause__, KeyError)


def test_errors_on_the_terminal_name_keys_and_those_of_python_options(capsys: pytest.CaptureFixture[str]) -> None:
    error = InputError("CaptureOptions.exposure", **ERROR)
    show_input_error(error)
    said = " ".join(capsys.readouterr().err.split())
    assert said == "Error: lamps.exposure: expected same, found lamps.exposure=free. Raise scene.ply.max_surfels."
    assert "CaptureOptions(exposure='free')" in str(error)
