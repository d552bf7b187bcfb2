"""Sums, and what is decided by them, are the same for any number of threads."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from bits import THREADS, outcome
from rgspipe.machine.sums import CHUNK, average, total


@pytest.fixture
def threads() -> Iterator[None]:
    """torch's number of threads as it was, afterwards."""
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def test_a_sum_is_the_same_for_any_number_of_threads(threads: None) -> None:
    """That torch's own sum is not shows that the sizes are large enough to tell."""
    values = torch.randn(10 * CHUNK + 123, generator=torch.Generator().manual_seed(0))
    found, theirs = set(), set()
    for count in (1, 2, 3, 4):
        torch.set_num_threads(count)
        found.add((float(total(values)), float(average(values.reshape(-1, 1)))))
        theirs.add(float(values.sum()))
    assert len(found) == 1 and len(theirs) > 1


@given(st.lists(st.floats(-1e6, 1e6), max_size=50), st.integers(1, 400))
def test_a_sum_is_that_of_the_numbers(numbers: list[float], repeats: int) -> None:
    values = torch.tensor(numbers * repeats, dtype=torch.float64)
    exact = math.fsum(values.tolist())
    # Measured: 2e-16 of the sum of magnitudes.
    assert abs(float(total(values)) - exact) <= 1e-14 * float(values.abs().sum()) + 1e-300


def test_a_mean_has_the_gradient_of_a_mean() -> None:
    values = torch.randn(2, CHUNK, 3, dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(average(values), values)
    torch.testing.assert_close(gradient, torch.full_like(values, 1.0 / values.numel()), rtol=1e-14, atol=0.0)


@pytest.mark.slow
def test_training_and_fits_are_the_same_for_any_number_of_threads() -> None:
    """Else a sweep of several jobs would make other artifacts than a plain run, under the same fingerprint."""
    found = [outcome(changes) for changes in THREADS]
    assert sum(map(len, found[0])) > 1000
    assert found[0] == found[1] == found[2]
