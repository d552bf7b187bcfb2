"""Rows of fits in the zoo, and their figures against what rooms are like."""

from __future__ import annotations

import math

import pandas as pd
import pytest

from rgspipe.studies.lights import figures
from rgspipe.studies.zoo import SCARCE, WHITE, failed_rows, fit_rows, fits_table, groups, misled, range_text, scarce
from zoo_fits import CLASSES, five_rooms, five_rooms_figures, room_of, targets


def _row(figures: pd.DataFrame, part: str, name: str, value: str, views: int = 1) -> pd.Series:
    keys = ("part", "property", "value", "views")
    (found,) = figures[(figures[list(keys)] == (part, name, value, views)).all(axis=1)].index
    return figures.loc[found]


def test_a_fit_is_silently_wrong_if_it_converged_off_the_truth_and_outside_its_region() -> None:
    table = five_rooms()
    assert table.loc[table["silent"], ["seed", "occlusion"]].drop_duplicates().to_numpy().tolist() == [[1, "occluded"]]
    for told in (targets(1, (0.05,), inside=True), targets(1, (0.05,), inside=False, result="undetermined")):
        assert not fits_table(fit_rows(room_of(7), told))["silent"].any()


def test_a_failed_training_counts_as_missed_and_a_room_that_could_not_be_built_does_not_count() -> None:
    figures = five_rooms_figures()
    final, work = (_row(figures, part, "all", "all") for part in ("final", "work"))
    assert (final["rooms"], final["count"], final["success"]) == (2, 6, 0.5)
    assert math.isinf(final["position"]) or final["position"] > 0.003  # The median lies between 0.003 and ∞.
    # Three rooms, of which the last has no fits that count: 2 of 6 solved.
    assert (work["rooms"], work["with_truth"], work["success"]) == (3, 6, pytest.approx(1 / 3))
    assert work["silent"] == pytest.approx(1 / 6) and work["inside_95"] == 0.5


def test_a_failed_training_has_the_figures_of_fits_that_found_nothing() -> None:
    nothing = targets(1, (math.inf,) * 3).assign(intensity_error=math.inf, count_right=False, types_right=False)
    found = fit_rows(room_of(4), targets(1, (0.001,)).assign(count_right=True, types_right=True))
    rooms = found + fit_rows(room_of(2), nothing.assign(result="not_enough_light", inside_95=pd.NA))
    failed = found + failed_rows(room_of(2), CLASSES, "search_lm", 1, "train_surfels", "the loss is NaN")
    unbuilt = found + failed_rows(room_of(2), CLASSES, "search_lm", 1, "generate_dataset", "no place for a camera")
    names = ["with_truth", "position", "intensity", "success", "right_number", "right_types", "inside_95", "silent"]
    expected, counted, passed_over = (
        pd.Series(figures(fits_table(rows), 0, resamples=0))[names].tolist() for rows in (rooms, failed, unbuilt)
    )
    assert counted == expected == [4.0, math.inf, math.inf, 0.25, 0.25, 0.25, 1.0, 0.0]
    assert passed_over == [1.0, 0.001, 0.02, 1.0, 1.0, 1.0, 1.0, 0.0]


def test_fits_are_grouped_by_every_property_that_is_known() -> None:
    figures = five_rooms_figures()
    views = figures[(figures["property"] == "train_views") & (figures["part"] == "work") & (figures["views"] == 3)]
    # Seeds 1 and 5 have 30 and 40 views, seed 3 has 80.
    assert views[["value", "rooms"]].to_numpy().tolist() == [["below 50", 2], ["75 and more", 1]]
    unseen = figures[(figures["property"] == "unseen") & (figures["views"] == 3)]
    assert set(unseen["value"]) == {"5 to 15 %", "30 % and more"}
    assert set(figures.loc[figures["property"] == "grade", "value"]) == {"fair", "good"}
    assert set(figures.loc[figures["property"] == "occlusion", "value"]) == {"visible", "out_of_frame", "occluded"}
    assert set(figures["views"]) == {1, 3}


def test_white_rooms_with_little_noise_stand_by_themselves() -> None:
    rows = [
        row
        for seed, noise, tone in ((1, 0.03, "white"), (3, 0.05, "white"), (5, 0.01, "mixed"))
        for row in fit_rows(room_of(seed, noise=noise, tone=tone), targets(3, (0.001,)))
    ]
    (white,) = (group for group in groups(fits_table(rows)) if group.value == WHITE)
    assert white.rows["seed"].tolist() == [1]


def test_the_scarce_quarter_is_of_rooms_and_by_both_ranks() -> None:
    rows = []
    for seed in range(8):
        # Views and lenses rise together but for seed 7: most views, narrowest lens.
        known = {"train_views": 30 + seed, "lens": 29.0 if seed == 7 else 30.0 + seed}
        rows += fit_rows(room_of(seed, **known), targets(1, (0.001, 0.002)))
    table = fits_table(rows)
    assert sorted(set(scarce(table)["seed"])) == [0, 1] and len(scarce(table)) == 4
    assert SCARCE in {group.value for group in groups(table)}


def test_grades_that_say_good_where_lights_are_far_off_are_named() -> None:
    assert misled(five_rooms())[["seed", "position_error"]].to_numpy().tolist() == [[3, 0.04]] * 2


def test_ranges_read_as_they_are_meant() -> None:
    assert range_text("lens", -math.inf, 45.0) == "below 45"
    assert range_text("unseen", 0.05, 0.15) == "5 to 15 %"
    assert range_text("noise", 0.06, math.inf) == "6 % and more"
