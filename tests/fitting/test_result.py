"""A result prints as people read it, and is saved with how sure it is."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from rgspipe.datasets.alternatives_file import read_alternatives
from rgspipe.datasets.covariance_file import read_covariances
from rgspipe.datasets.light_file import read_lights
from rgspipe.fitting.alternative import Alternative
from rgspipe.fitting.findings import FitStatus, Undetermined
from rgspipe.fitting.result import FitResult, dark_result
from rgspipe.fitting.result_text import headline, light_line
from rgspipe.scene import LightRig, PointLight
from rgspipe.scene.lights.sphere import SphereLight

NEAR, FAR = PointLight([0.1, 0.2, 0.3], [1.0, 2.0, 3.0]), PointLight([0.5, 0.5, 0.5], 4.0)

#: Variances of position and intensity; the height is not determined.
SURE, UNSURE = [1e-4] * 3 + [4e-4] * 3, [1e-4, 1e-4, float("inf"), 1.0, 1.0, 1.0]


REASON = "These views do not tell all of the lights. Not determined by these views: z < 1"


def result(rig: LightRig = (NEAR, FAR)) -> FitResult:
    spread = tuple(torch.diag(torch.tensor(row, dtype=torch.float64)) for row in (SURE, UNSURE))[: len(rig)]
    return FitResult(rig, (Undetermined(len(rig), len(rig), ("z < 1",)),), 0.01, 7, 20, 2, 1.234, spread, ())


def test_a_result_reads_like_a_sentence_and_a_list() -> None:
    assert (
        str(result()).splitlines()
        == repr(result()).splitlines()
        == [
            "2 lights, undetermined after 1.2 s",
            "  point at (0.100, 0.200, 0.300) ± 0.0100, RGB (1.000, 2.000, 3.000) W/sr ± 0.020",
            "  point at (0.500, 0.500, 0.500) ± unknown, RGB (4.000, 4.000, 4.000) W/sr ± 1.000",
            f"{REASON} of light 2.",
        ]
    )
    assert str(dark_result(0.1)).startswith("no light, not enough light after 0.1 s")
    assert "±" not in light_line(NEAR)


def test_a_faint_light_is_not_told_as_none() -> None:
    """Images have any unit: those of a camera's own may be a millionth of the scene's."""
    faint = light_line(PointLight([0.1, 0.2, 0.3], [6e-7, 8e-7, 0.0]), torch.full((6, 6), 1e-14).tolist())
    assert faint.endswith("RGB (6.00e-07, 8.00e-07, 0.00e+00) W/sr ± 1.00e-07")


def test_places_in_a_small_scene_are_told() -> None:
    """A table top of 5 cm, in metres: three decimals are a millimetre."""
    spread = torch.diag(torch.tensor([4e-5] * 3 + [0.01] * 3).square()).tolist()
    small = light_line(PointLight([0.0004, -0.0003, 0.0002], 0.3), spread)
    assert small.startswith("point at (0.000400, -0.000300, 0.000200) ± 0.0000400, RGB (0.300, 0.300, 0.300)")
    assert light_line(PointLight([0.03, 0.0, 0.0], 0.3), spread).startswith(
        "point at (0.0300, 0.0000, 0.0000) ± 0.00004"
    )
    sphere = light_line(SphereLight([0.004, 0.0, 0.0], 0.3, 0.0004))
    assert sphere.startswith("sphere at (0.00400, 0.00000, 0.00000), radius 0.000400")
    assert light_line(PointLight([0.0, 0.0, 0.0], 0.3), spread).startswith("point at (0.000, 0.000, 0.000) ± 0.0000")


def test_a_notebook_shows_the_same_as_a_list() -> None:
    page = result((NEAR,))._repr_html_()
    assert page.startswith("<b>1 light, undetermined after 1.2 s</b><ul><li>point at (0.100,")
    assert page.endswith("z &lt; 1.")


def test_a_saved_result_is_a_light_file_with_its_uncertainty(tmp_path: Path) -> None:
    found = replace(result(), alternatives=(Alternative((NEAR,), 3.0, 2.0, -1, True),))
    found.save(tmp_path / "lights.json", psnr=41.5)
    [other] = read_alternatives(tmp_path / "lights.json")
    assert (other.told, other.ruled_out) == ("1 light: 3 times the cost.", True)
    assert torch.equal(other.lights[0].position, NEAR.position)
    for light, again in zip(found.lights, read_lights(tmp_path / "lights.json"), strict=True):
        assert torch.equal(light.position, again.position) and torch.equal(light.intensity, again.intensity)
    for matrix, again in zip(found.covariance, read_covariances(tmp_path / "lights.json"), strict=True):
        assert torch.equal(matrix, again)
    told = json.loads((tmp_path / "lights.json").read_text())
    assert (told["version"], told["result"], told["psnr"]) == (1, "undetermined", 41.5)
    with pytest.raises(ValueError, match="version"):
        found.save(tmp_path / "other.json", version=2)


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (FitStatus.CONVERGED, "converged in 1.4 s"),
        (FitStatus.MAX_ITERATIONS, "out of iterations after 1.4 s"),
        (FitStatus.UNDETERMINED, "undetermined after 1.4 s"),
        (FitStatus.AMBIGUOUS, "ambiguous after 1.4 s"),
        (FitStatus.UNEXPLAINED, "unexplained after 1.4 s"),
        (FitStatus.AT_BOUND, "stopped at the bound after 1.4 s"),
        (FitStatus.NOT_ENOUGH_LIGHT, "not enough light after 1.4 s"),
    ],
)
def test_every_end_of_a_fit_is_a_phrase(status: FitStatus, words: str) -> None:
    assert headline(1, status, 1.42) == f"1 light, {words}"
