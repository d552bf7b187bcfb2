"""Models of a room made with settings, their errors against a truth, and what fits on it end at."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.benchmark.image_error import image_errors
from rgspipe.benchmark.light_bias import light_biases
from rgspipe.benchmark.rooms import ROOMS, Room
from rgspipe.benchmark.scaling import scaling
from rgspipe.benchmark.settings import Model, RenderSetting, Workshop, sweep
from rgspipe.benchmark.truth import Truth
from rgspipe.stages.benchmark.benchmark import preset_settings

SMALL = RenderSetting(surfels=800, gather_rays=16, patches=60, resolution=16)


@pytest.fixture(scope="module")
def room() -> Room:
    return ROOMS["cornell"]()


@pytest.fixture(scope="module")
def model(room: Room) -> Model:
    return Workshop(room).model(replace(SMALL, resolution=32))


@pytest.fixture(scope="module")
def truth(room: Room, model: Model) -> Truth:
    """A truth that is the model's own images, with noise of a known size."""
    generator = torch.Generator().manual_seed(0)
    images, noise = {}, {}
    for kind in ("direct", "global"):
        lights = range(len(room.lights))
        stack = [torch.stack([model.image(c, room.rig(k), kind == "global") for k in lights]) for c in range(2)]
        exact = torch.stack(stack)
        halves = [exact + 1e-4 * torch.randn(exact.shape, generator=generator) for _ in range(2)]
        images[kind], noise[kind] = 0.5 * (halves[0] + halves[1]), 0.5 * (halves[0] - halves[1])
    return Truth("cornell", 32, 8, images, noise)


def test_errors_vanish_against_the_models_own_images(room: Room, truth: Truth) -> None:
    rows = image_errors(room, truth, [replace(SMALL, resolution=32), replace(SMALL, resolution=32, shadows="none")], 1)
    # Measured 85 dB and more, which is where the truth's own noise hides the rest; 30 dB without shadows.
    assert rows["global_db"][0] > 70.0 and rows["direct_db"][0] > 70.0
    assert rows["global_db"][1] < 45.0
    assert (rows[["forward_ms", "step_ms", "gather_s", "operators_mib"]] > 0).all(axis=None)


def test_a_fit_from_the_truth_stays_there_on_the_models_own_images(room: Room, truth: Truth, model: Model) -> None:
    rows = light_biases(room, truth, model)
    assert len(rows) == 3 * len(room.lights)
    # Measured 2e-4 at most: what the noise of 1e-4 moves.
    assert float(rows["position_error"].median()) < 1e-3
    assert rows["in_the_open"].sum() == 9


def test_float64_products_change_nothing_that_could_be_seen(model: Model, room: Room) -> None:
    precise = Model(replace(model.setting, precision="float64"), model.frozen, model.views, (), model.cost)
    image, exact = model.image(0, room.rig(0)), precise.image(0, room.rig(0))
    # Measured 3e-7 of the brightest.
    assert float((image - exact).abs().max()) < 1e-5 * float(exact.max())


def test_light_at_pixels_replaces_the_direct_part_alone(room: Room) -> None:
    workshop = Workshop(room)
    plain, sharp = workshop.model(SMALL), workshop.model(replace(SMALL, shadows="pixels"))
    bounced = [m.image(0, room.rig(1)) - m.image(0, room.rig(1), indirect=False) for m in (plain, sharp)]
    # Measured 2e-7.
    assert float((bounced[0] - bounced[1]).abs().max()) < 1e-5 * float(bounced[0].max())


def test_the_sweep_holds_the_presets_and_turns_every_knob() -> None:
    presets = preset_settings()
    assert list(presets) == ["draft", "standard", "reference"]
    settings = sweep(presets.values())
    assert len(set(settings)) == len(settings)
    assert set(presets.values()) <= set(settings)
    for knob in RenderSetting.__dataclass_fields__:
        assert len({getattr(setting, knob) for setting in settings}) > 1, knob


def test_growth_is_measured_for_every_part(room: Room) -> None:
    rows = scaling(room, counts=(300, 600), repetitions=1)
    assert rows.groupby("surfels").size().tolist() == [5, 5]
    assert (rows["ms"] > 0).all() and (rows["operators_mib"] > 0).all()
