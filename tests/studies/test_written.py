"""A study on disk: a table, a text and a picture, and what stands beside them."""

from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from rgspipe.studies.written import Study, write_study


def test_a_study_is_a_table_a_text_and_a_picture(tmp_path: Path) -> None:
    table = pd.DataFrame({"case": ["clean"], "position": [0.1 + 0.2]})
    write_study(tmp_path, "views", Study(table, "| é |\n", Figure(figsize=(1.0, 1.0))))
    # Every digit is in the file.
    found = pd.read_csv(tmp_path / "study.csv", float_precision="round_trip")
    assert list(found) == ["kind", "case", "position"] and found.pop("kind").tolist() == ["views"]
    pd.testing.assert_frame_equal(found, table, check_exact=True)
    assert (tmp_path / "study.md").read_text(encoding="utf-8") == "| é |\n"
    assert (tmp_path / "study.png").read_bytes().startswith(b"\x89PNG")
    assert len(list(tmp_path.iterdir())) == 3


def test_what_stands_beside_a_study_is_in_its_folder(tmp_path: Path) -> None:
    beside = {"courses.csv": b"step\n", "pictures/a.png": b"a"}
    table = pd.DataFrame({"scene": ["room"]})
    write_study(tmp_path, "courses", Study(table, "", Figure(figsize=(1.0, 1.0)), beside))
    assert {name: (tmp_path / name).read_bytes() for name in beside} == beside
    assert len(list(tmp_path.iterdir())) == 5 and list(table) == ["scene"]
