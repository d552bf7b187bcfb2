"""What a report shows of the lamps that a capture found."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from frozen_store import artifact
from pages.conftest import make_contents
from rgspipe.datasets.light_file import write_lights
from rgspipe.pages.report import render_report
from rgspipe.scene import PointLight
from rgspipe.stages.report.captured import captured_lamps, captured_marks, captured_section

LAMP = PointLight(torch.tensor([0.48, 0.5, 1.56]).double(), torch.tensor([2.4, 2.0, 1.5]).double())


def write_capture(folder: Path) -> None:
    known = {"lights": [{"covariance": torch.diag(torch.tensor([0.04, 0.02, 0.03])).tolist()}]}
    write_lights(folder / "lamps.json", LAMP, known)
    write_lights(folder / "lamps_evening.json", replace(LAMP, position=LAMP.position + 1.0))
    told = {"words": "1 lamp was on.", "others": {"evening": {"words": "1 other lamp was on."}}}
    (folder / "metrics.json").write_text(json.dumps(told))


def test_lamps_of_every_lighting_are_shown_with_what_is_to_be_thought_of_them(tmp_path: Path) -> None:
    """They are what a capture is made for; its report showed nothing of them."""
    made = artifact(tmp_path, "capture_surfels", write_capture)
    (section,) = captured_section(made)
    assert section.words == ["1 lamp was on.", "evening: 1 other lamp was on."]
    # ± is the root of the mean variance, 0.03.
    assert section.rows[0] == ["1", "point", "0.48, 0.50, 1.56", "0.173", "2.40 / 2.00 / 1.50"]
    assert section.rows[1][0] == "evening 1" and section.rows[1][3] == "—"
    assert [light.position[0].item() for light in captured_lamps(made)] == pytest.approx([0.48, 1.48])
    first, second = captured_marks(made)
    assert (first.name, first.told) == ("lamp 1", "± 0.173 an axis") and first.covariance.diagonal().sum() == (
        pytest.approx(0.09)
    )
    assert (second.name, second.told, second.covariance) == ("lamp evening 1", "± not known", None)
    page = render_report(replace(make_contents(), captured=[section], training={"surfels": 9}, training_log=None))
    assert "1 other lamp was on." in page and 'href="#lamps"' in page and "found in the photographs" in page
    assert "not recorded" not in page and "no training log" not in page


def test_a_scene_whose_lamps_were_known_has_none(tmp_path: Path) -> None:
    made = artifact(tmp_path, "train_surfels", lambda folder: (folder / "metrics.json").write_text("{}"))
    assert captured_section(made) == captured_section(None) == [] and captured_lamps(made) == ()
    assert captured_marks(made) == []
    assert 'href="#lamps"' not in render_report(make_contents())
