"""The report: complete, self-contained, and outspoken about what is missing."""

import dataclasses
import math
import re

import numpy as np
import pandas as pd

from html_page import Page
from rgspipe.evaluation import images
from rgspipe.evaluation.summary import summary_table
from rgspipe.evaluation.tables import target_table
from rgspipe.pages import html as shared
from rgspipe.pages import report
from rgspipe.pages.glossary import GLOSSARY
from rgspipe.pages.provenance import stage_record
from rgspipe.studies.lights import STATUSES


def _empty(fitted) -> report.ReportContents:
    table = target_table(fitted(1)[0].iloc[:0], {}, {}, 1.0)
    return report.ReportContents("void", summary_table(table, 0), table, fitted(1)[1].iloc[:0])


def test_a_report_refers_to_nothing_outside_itself(full_report):
    page = Page(full_report)
    outside = [address for address in page.addresses if not address.startswith(("data:image/", "#"))]
    assert page.pictures and not outside
    assert "link" not in page.tags and "iframe" not in page.tags
    assert not [word for word in ("http:", "https:", "@import", "url(") if word in full_report]


def test_words_for_how_fits_end_are_explained() -> None:
    assert set(STATUSES) <= set(GLOSSARY) and list(GLOSSARY) == sorted(GLOSSARY, key=str.lower)


def test_pictures_do_not_wait_to_be_looked_at(full_report):
    """Those that came later moved what is below: the list of contents led as much as 5000 pixels astray."""
    assert "loading=" not in full_report


def test_one_target_has_no_interval(fitted):
    targets, curves = fitted(1)
    targets = targets.drop_duplicates("occlusion")
    summary = summary_table(targets, 0)
    contents = dataclasses.replace(_empty(fitted), summary=summary, targets=targets, curves=curves)
    several = int((summary["with_truth"] > 1).sum())
    assert 0 < several < len(summary)
    assert len(re.findall(r"<td>[\d.]+ to [\d.]+ %</td>", report.render_report(contents))) == several


def test_a_report_shows_everything_and_misses_nothing(full_report):
    page = Page(full_report)
    assert 'class="missing"' in full_report and "One note." in page.text  # the note is the only thing of its kind
    assert full_report.count('<p class="missing">') == 1
    for text in ("36.50 dB", "test/r_0001", "33.25", "occluded_002", "0123abcd", "640", "torch 2.13.0", "all classes"):
        assert text in page.text
    # six training views, the plan, two targets; training, split, comparison, study, errors, two light drawings,
    # convergence, one fit
    assert len(page.pictures) == 9 + 9
    assert all(words for _, words in page.pictures), "every picture says what it shows"
    assert {address.removeprefix("#") for address in page.addresses if address.startswith("#")} <= set(page.names)


def test_a_judged_scene_stands_beside_true_surfels(full_report, full_contents, fitted):
    page = Page(full_report)
    for text in ("true surfels, light at pixels", "38.25 dB", "3,825.00 %", "What the trained scene costs the lights"):
        assert text in page.text
    # Pixels that cannot be told apart leave the table.
    judged = dataclasses.replace(_empty(fitted), quality=full_contents.quality, split=full_contents.split.iloc[:0])
    page = Page(report.render_report(judged))
    assert "no passes by which pixels could be told apart" in page.text and "38.25 dB" in page.text


def test_a_report_shows_the_scene_its_targets_and_their_truth(full_report):
    text = Page(full_report).text
    assert "as noise no longer averages out" in text
    assert "8 training views of 16 × 8 pixels, 2 held-out views, 2 targets with 1 view each" in text
    assert "r_0007: light at (0.10, −0.20, 0.30), 1.00 / 1.50 / 2.00 W/sr" in text
    assert "visible_000: light at (0.10, −0.20, 0.30), 1.00 / 1.50 / 2.00 W/sr; recovered 1.23 % away" in text
    assert "occluded_000: true light not known" in text


def test_a_study_is_shown_with_its_remark_and_left_out_where_none_was_made(full_contents, fitted):
    made = {"study": full_contents.study, "study_remark": "Made with other settings."}
    contents = dataclasses.replace(_empty(fitted), **made)
    text = Page(report.render_report(contents)).text
    assert "What bad captures cost" in text and "views=25" in text and "Made with other settings." in text
    assert "bad captures" not in Page(report.render_report(dataclasses.replace(contents, study=None))).text


def test_right_numbers_and_types_are_shown_where_they_were_sought(full_contents, fitted):
    targets = full_contents.targets.copy()
    targets.loc[0, ["types_right", "success"]] = [False, True]
    targets.loc[1, ["count_right", "types_right", "success", "lights_found"]] = [False, False, False, 2]
    told = dataclasses.replace(_empty(fitted), targets=targets, summary=summary_table(targets, 0, 0))
    page = Page(report.render_report(told)).text
    assert "yes, wrong type" in page and "no: 2 found, 1 there" in page and "Right" not in page
    page = Page(report.render_report(dataclasses.replace(told, number_sought=True, types_sought=True))).text
    assert page.count("Right") == 2 and "89 %" in page and "78 %" in page


def test_text_from_files_is_escaped(full_report):
    assert "<step>" not in full_report and "small &lt;step&gt;" in full_report
    assert "<cornell>" not in full_report and "&lt;cornell&gt;" in full_report


def test_an_empty_report_says_what_is_missing(fitted):
    page = Page(report.render_report(_empty(fitted)))
    assert not page.pictures
    for text in (
        "quality of the trained scene is not known",
        "No lights were fitted",
        "no pictures of the scene",
        "no pictures of single fits",
        "Nothing is known of the stages",
        "configuration is not known",
    ):
        assert text in page.text


def test_unknown_truth_is_stated_and_shown_as_a_dash(fitted):
    targets, curves = fitted(1, with_truth=False)
    summary = summary_table(targets, 0)
    page = Page(
        report.render_report(dataclasses.replace(_empty(fitted), summary=summary, targets=targets, curves=curves))
    )
    assert "3 (0 with truth)" in page.text and "unknown" in page.text and "nan" not in page.text
    assert "no target has a known truth" in page.text


def test_failed_fits_are_shown_as_infinitely_far_away(fitted):
    targets, curves = fitted(1)
    targets.loc[0, ["position_error", "intensity_error"]] = math.inf
    summary = summary_table(targets, 0)
    page = Page(
        report.render_report(dataclasses.replace(_empty(fitted), summary=summary, targets=targets, curves=curves))
    )
    assert "∞" in page.text


def test_large_pictures_do_not_make_a_large_report(full_contents):
    noise = images.png_bytes(np.random.default_rng(0).integers(0, 256, (900, 1500, 3), dtype=np.uint8))
    pictures = [report.FitPicture("search_lm, 1 view", f"target {index}", noise) for index in range(6)]
    html = report.render_report(dataclasses.replace(full_contents, fits=pictures))
    assert len(html) < 8_000_000  # measured 5.3 MB


def test_reports_of_equal_contents_are_equal(full_report, full_contents):
    assert report.render_report(full_contents) == full_report


def test_stage_records_do_without_what_a_manifest_lacks():
    record = stage_record("freeze", {})
    assert {record.fingerprint, record.seconds, record.memory, record.machine, record.code} == {shared.MISSING}


def test_captions_say_what_is_known():
    assert (
        report.picture_caption("a", "worst", 0.0123, 31.04)
        == "a, worst of its class: position error 1.23 %, PSNR 31.0 dB"
    )
    assert report.picture_caption("a", "median", None, None) == "a, median of its class"
    assert report.picture_caption("a", "worst", math.inf, 20.0).startswith("a, worst of its class: position error ∞")


def test_tables_read_back_from_csv_render_the_same(tmp_path, full_contents, full_report):
    contents = full_contents
    contents.targets.to_csv(tmp_path / "metrics.csv", index=False)
    again = pd.read_csv(tmp_path / "metrics.csv", dtype={"success": "boolean", "result": str, "reason": str})
    html = report.render_report(dataclasses.replace(contents, targets=again))
    assert Page(html).text == Page(full_report).text
