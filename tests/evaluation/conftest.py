"""A small set of results for the tests of figures."""

import pytest

from fitted_lights import make_fitted


@pytest.fixture
def fitted():
    """`fitted(views, seed=0, with_truth=True)`: (target table, convergence table) of three targets a class."""
    return make_fitted
