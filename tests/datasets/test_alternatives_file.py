"""What a fit weighed against its answer is read as it was written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from rgspipe.datasets.alternatives_file import read_alternatives
from rgspipe.errors import InputError

LIGHT = {"type": "point", "position": [0.1, 0.2, 0.3], "intensity": [1.0, 1.0, 1.0]}
WHOLE = {"lights": [LIGHT], "told": "3 times the cost.", "ruled_out": True}


def test_alternatives_are_read_and_need_not_be_there(tmp_path: Path) -> None:
    path = tmp_path / "lights.json"
    path.write_text(json.dumps({"lights": [], "alternatives": [WHOLE]}))
    [one] = read_alternatives(path)
    assert one.told == "3 times the cost." and one.ruled_out
    assert torch.equal(one.lights[0].position, torch.tensor(LIGHT["position"], dtype=torch.float64))
    path.write_text(json.dumps({"lights": []}))
    assert read_alternatives(path) == ()


@pytest.mark.parametrize(
    ("broken", "told"),
    [
        (5, "alternatives: expected a list"),
        ([5], "alternatives: expected a list"),
        ([{**WHOLE, "told": 5}], "told as a text"),
        ([{**WHOLE, "ruled_out": "yes"}], "ruled_out as true or false"),
        ([{**WHOLE, "lights": [{**LIGHT, "type": "glow"}]}], "type"),
        ([{"told": "x", "ruled_out": True}], "lights"),
    ],
)
def test_broken_ones_are_refused(tmp_path: Path, broken: object, told: str) -> None:
    path = tmp_path / "lights.json"
    path.write_text(json.dumps({"lights": [], "alternatives": broken}))
    with pytest.raises(InputError, match=told):
        read_alternatives(path)
