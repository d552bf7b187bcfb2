"""Lamps that were found by variances of a room without them are found again beside the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lamp_problem import problem, true_lamps
from rgspipe.capture.candidates import CandidateLamps
from rgspipe.capture.receivers import Receivers
from rgspipe.capture.search import looked_for_again


def test_a_lamp_in_a_wrong_place_is_found_again_beside_the_others() -> None:
    made = problem()
    made = replace(made, receivers=Receivers(made.frozen.with_dictionary(4, seed=0)))
    places = true_lamps(made).places.copy()
    places[1] *= -1.0
    stuck = made.refined(made.lamps(places, true_lamps(made).logs - 1.0), 25)
    found = looked_for_again(made, CandidateLamps.of(made), stuck, lambda *_: None)
    assert made.cost(found) < 0.1 * made.cost(stuck)
    assert np.linalg.norm(found.places - true_lamps(made).places, axis=1).max() < 0.003
