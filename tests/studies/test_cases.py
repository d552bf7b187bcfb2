"""Cases in words become configuration keys and values."""

import pytest

from rgspipe.errors import InputError
from rgspipe.studies.cases import parse_case


@pytest.mark.parametrize(
    ("text", "name", "changes"),
    [
        ("clean", "clean", {}),
        (" clean ", "clean", {}),
        ("as it is: clean", "as it is", {}),
        ("depth_noise=0.01", "depth_noise=0.01", {"capture.depth_noise": 0.01}),
        ("capture.views=25 normals=false", None, {"capture.views": 25, "capture.normals": False}),
        ("views=null", None, {"capture.views": None}),
        ("box gone: model_error.missing=[0,0,-0.5,1,1,0]", "box gone", {"model_error.missing": [0, 0, -0.5, 1, 1, 0]}),
        ("fit.truth=a:b.json", "fit.truth=a:b.json", {"fit.truth": "a:b.json"}),
    ],
)
def test_a_case_is_what_it_says(text: str, name: str | None, changes: dict) -> None:
    found = parse_case(text, "study.cases", "capture")
    assert found.name == (name or text) and found.changes == changes
    assert [type(value) for value in found.changes.values()] == [type(value) for value in changes.values()]


def test_without_a_section_keys_are_those_of_the_first_level() -> None:
    assert parse_case("seed=3", "light_study.cases").changes == {"seed": 3}


@pytest.mark.parametrize(
    "text", ["", "noise", "depth_noise=", "=3", "clean depth_noise=0.1", "named:", ": views=3", "missing=[0, 1]"]
)
def test_a_case_that_says_nothing_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"study\.cases"):
        parse_case(text, "study.cases", "capture")
