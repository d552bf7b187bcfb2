"""An even part of the surfels sees what all of them see."""

from __future__ import annotations

import numpy as np
import pytest

from lamp_problem import frozen_room, unseen
from rgspipe.capture.receivers import Receivers
from rgspipe.renderer.frozen import FrozenScene


@pytest.fixture(scope="module")
def part() -> Receivers:
    return Receivers.of(frozen_room(), unseen().astype(np.int64), 400)


def test_few_surfels_are_all_looked_at() -> None:
    frozen = frozen_room()
    every = Receivers.of(frozen, unseen().astype(np.int64), len(frozen.surfels))
    assert every.are_all
    assert every.surfels is frozen.surfels


def test_there_are_as_many_as_asked_for_and_each_stands_for_its_own_kind(part: Receivers) -> None:
    count = len(part.surfels)
    assert 300 < count <= 400  # 322: cells hold whole rows of the room's regular surfels
    stand_in = part.stand_in
    np.testing.assert_array_equal(stand_in[part.chosen], np.arange(count))
    np.testing.assert_array_equal(unseen(), part.at(unseen())[stand_in])
    cosine = (part.frozen.surfels.normals * part.surfels.normals[stand_in]).sum(dim=1)
    assert float(cosine.min()) > 0.99  # all of the room's sides are along axes


def test_they_are_spread_evenly(part: Receivers) -> None:
    away = (part.frozen.surfels.centers - part.surfels.centers[part.stand_in]).norm(dim=1)
    # Measured 0.106 at most, 0.071 in the median; neighbours of all 1272 are 0.071 apart.
    assert float(away.max()) < 0.14


def test_surface_and_light_of_all_are_theirs(part: Receivers) -> None:
    frozen = part.frozen
    assert part.areas.sum() == pytest.approx(float(frozen.areas.sum()), rel=1e-5)
    own, every = part.gather, Receivers(frozen).gather
    np.testing.assert_allclose(own @ np.ones(own.shape[1]), part.at(every @ np.ones(every.shape[1])), rtol=1e-6)
    sent = np.random.default_rng(0).uniform(size=own.shape[1])
    np.testing.assert_allclose(own @ sent, part.at(every @ sent[part.stand_in]), rtol=1e-6)


@pytest.mark.parametrize("shadows", [False, True])
def test_lamps_send_them_what_they_send_them_among_all(part: Receivers, shadows: bool) -> None:
    places = np.array([[0.1, -0.2, 0.3], [-0.3, 0.1, -0.1]])
    for own, every in zip(
        part.irradiance(places, shadows), Receivers(part.frozen).irradiance(places, shadows), strict=True
    ):
        np.testing.assert_array_equal(own, every[:, part.chosen])


def test_light_of_lamps_that_stand_is_not_made_again(part: Receivers, monkeypatch: pytest.MonkeyPatch) -> None:
    places = np.array([[0.1, -0.2, 0.3], [-0.3, 0.1, -0.1]])
    first = part.irradiance(places)
    monkeypatch.setattr(FrozenScene, "unit_irradiance", lambda *_: pytest.fail("it is made again"))
    for own, again in zip(first, part.irradiance(places.copy()), strict=True):
        np.testing.assert_array_equal(own, again)


@pytest.mark.parametrize("own", [False, True])
def test_candidates_are_those_of_the_scene(part: Receivers, own: bool) -> None:
    dictionary = part.frozen.dictionary
    places, irradiance = (part.with_dictionary(dictionary.grid, dictionary.seed) if own else part).candidates()
    np.testing.assert_array_equal(places, dictionary.positions.numpy())
    np.testing.assert_array_equal(irradiance, dictionary.irradiance.numpy()[:, part.chosen])
