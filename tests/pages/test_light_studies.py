"""Studies of recovered lights on a page: every kind has its words, figure and table."""

from __future__ import annotations

import dataclasses

import pandas as pd
import pytest

from fitted_lights import make_fitted
from html_page import Page
from rgspipe.pages import report
from rgspipe.pages.light_studies import ALT, TITLES, LightStudy, light_studies
from rgspipe.studies.light_table import NOTES, TOGETHER
from rgspipe.studies.lights import KINDS, case_rows


@pytest.fixture
def table() -> pd.DataFrame:
    parts = [make_fitted(views)[0].assign(result="converged") for views in (1, 3)]
    return pd.concat([case_rows("cornell", "clean", part, seed=0, resamples=100) for part in parts])


def test_every_kind_is_described() -> None:
    assert set(TITLES) == set(ALT) == set(NOTES) == set(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_a_study_is_a_figure_and_a_table(table: pd.DataFrame, kind: str) -> None:
    (shown,) = light_studies([LightStudy(kind, table)])
    assert shown["figure"]["source"].startswith("data:image/svg+xml")
    assert all(len(row) == len(shown["headings"]) for row in shown["rows"])
    assert len(shown["rows"]) == (2 if kind in TOGETHER else len(table))


def test_a_study_without_truth_says_so(table: pd.DataFrame) -> None:
    (shown,) = light_studies([LightStudy("views", table.assign(position=float("nan")))])
    assert shown["figure"]["source"] is None and "known truth" in shown["figure"]["reason"]


def test_a_report_shows_the_studies_that_were_made(full_report, full_contents, table: pd.DataFrame) -> None:
    before = Page(full_report)
    assert "Studies of recovered lights" not in before.text
    studies = [LightStudy(kind, table.assign(case="<b>"), "Of another day.") for kind in KINDS]
    html = report.render_report(dataclasses.replace(full_contents, light_studies=studies))
    page = Page(html)
    for text in ("Studies of recovered lights", "How many views it takes", "Of another day.", NOTES["robustness"][:40]):
        assert text in page.text
    assert "<b>" not in html and "&lt;b&gt;" in html
    assert len(page.pictures) == len(before.pictures) + len(KINDS)
    assert all(words for _, words in page.pictures)
    assert {address.removeprefix("#") for address in page.addresses if address.startswith("#")} <= set(page.names)
