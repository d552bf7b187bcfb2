"""Commands that can be pasted."""

from __future__ import annotations

import shlex

from rgspipe.graph.commands import command
from rgspipe.program import program


def test_settings_are_taken_over_but_for_those_that_change_and_quoted() -> None:
    overrides = ["stage=freeze", "upstream=require", "scene=tutorial", "light.count=[1,2]", "fit.target=a b", "seed=3"]
    told = command("view", overrides, {"seed": None, "views.indices": (0, 2), "fit.suggest_view": True})
    assert "'light.count=[1,2]'" in told and "'fit.target=a b'" in told  # a shell would take them apart
    begin = [*program(), "stage=view"]
    assert shlex.split(told) == [
        *begin,
        *overrides[2:5],
        "seed=null",
        "views.indices=[0,2]",
        "fit.suggest_view=true",
    ]
