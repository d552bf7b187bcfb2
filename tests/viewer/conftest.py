"""One room for all tests of the viewer."""

from __future__ import annotations

import pytest

from lit_room import frozen_room
from rgspipe.renderer.frozen import FrozenScene


@pytest.fixture(scope="session")
def frozen() -> FrozenScene:
    return frozen_room()
