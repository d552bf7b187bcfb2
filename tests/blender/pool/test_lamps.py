"""Lamps of pools are drawn from their ranges."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from luminaire_files import ies
from rgspipe.blender.pool.lamps import LampRange


def test_leds_and_luminaires_fill_their_ranges(tmp_path: Path) -> None:
    names = ("one.ies", "other.ies")
    for name in names:
        (tmp_path / name).write_text(ies())
    lamps = LampRange(exponent=(2.0, 6.0), luminaires=tuple(str(tmp_path / name) for name in names))
    rng = np.random.default_rng(0)
    exponents = [lamps.draw(rng, "leds", index).exponent for index in range(200)]
    assert 2.0 <= min(exponents) < 2.2 and 5.8 < max(exponents) <= 6.0
    profiles = [lamps.draw(rng, "profiles", index) for index in range(4)]
    assert [light.table.name for light in profiles] == [light.table.name for light in profiles[:2]] * 2
    assert len({light.turn for light in profiles}) == 4
