"""A study on disk: a table, a text and a picture."""

from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from rgspipe.studies.written import write_study


def test_a_study_is_a_table_a_text_and_a_picture(tmp_path: Path) -> None:
    table = pd.DataFrame({"case": ["clean"], "position": [0.1 + 0.2]})
    write_study(tmp_path, table, "| é |\n", Figure(figsize=(1.0, 1.0)))
    # Every digit is in the file.
    found = pd.read_csv(tmp_path / "study.csv", float_precision="round_trip")
    pd.testing.assert_frame_equal(found, table, check_exact=True)
    assert (tmp_path / "study.md").read_text(encoding="utf-8") == "| é |\n"
    assert (tmp_path / "study.png").read_bytes().startswith(b"\x89PNG")
    assert len(list(tmp_path.iterdir())) == 3
