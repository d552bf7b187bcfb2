"""Tables as Markdown."""

from __future__ import annotations

import pandas as pd

from rgspipe.evaluation.markdown import markdown_table


def test_a_markdown_table_shows_what_is_there() -> None:
    table = pd.DataFrame({"name": ["a", "b"], "value": [1.234, float("nan")], "flag": [True, False]})
    text = markdown_table(
        table, {"name": ("what", ""), "value": ("how much", ".1f"), "missing": ("no", ""), "flag": ("on", "")}
    )
    assert text == "| what | how much | on |\n| --- | --- | --- |\n| a | 1.2 | yes |\n| b | – | no |\n"
