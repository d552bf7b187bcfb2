"""What the configuration says of unknown lights."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from luminaire_files import ies
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.config.light import LightConfig
from rgspipe.errors import InputError
from rgspipe.fitting import LightSpec
from rgspipe.fitting.spec import AUTO, TYPES
from rgspipe.options import settings
from rgspipe.renderer.zonal_harmonics import BandLimit
from rgspipe.scene.lights import KINDS
from rgspipe.stages.lights.fit_light import STAGE, band_limit
from rgspipe.stages.lights.spec import light_spec, table_files


def test_one_point_light_is_looked_for_by_default() -> None:
    spec = light_spec(RgspipeConfig(stage="fit_light"))
    assert (spec.type, spec.count, spec.aimed, spec.shape_free) == ("point", 1, False, False)


def test_every_kind_can_be_looked_for() -> None:
    """By its name, in the shape that it usually has."""
    assert {setting.name: setting for setting in settings(LightConfig)}["type"].choices == TYPES == (*KINDS, AUTO)
    for name, kind in KINDS.items():
        spec = light_spec(with_changes(RgspipeConfig(stage="fit_light"), {"light.type": name}))
        (found,), usual = spec.kinds, kind.shaped()
        assert type(found) is kind and found.columns() == pytest.approx(usual.columns())
        assert (spec.shape is None) == (not usual.shape), "numbers of a shape are settings"


def test_angles_become_radians_and_a_blend_stays_a_share() -> None:
    config = with_changes(
        RgspipeConfig(stage="fit_light"),
        {"light.type": "spot", "light.count": None, "light.spot.cone_angle": 30.0, "fit.shape": "free"},
    )
    spec = light_spec(config)
    assert spec.count is None and spec.shape_free and len(spec.kinds[0].variants()) == 3
    assert spec.shape.cone_angle == pytest.approx(math.pi / 6) and spec.shape.falloff == 0.15
    linear = with_changes(config, {"light.spot.profile": "linear", "light.spot.falloff": 15.0})
    assert light_spec(linear).shape.falloff == pytest.approx(math.pi / 12)
    assert [shape.falloff / shape.cone_angle for shape in light_spec(linear).shape.variants()] == pytest.approx(
        [0.5] * 3
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"light.type": "spot", "light.spot.falloff": 2.0}, "at most 1"),
        ({"light.type": "auto", "light.spot.profile": "linear", "light.spot.falloff": 40.0}, "at most 25"),
        ({"fit.method": "paper_adam", "light.count": None}, "light.count: .* 1 to 8"),
        ({"fit.method": "paper_adam", "light.type": "auto"}, "light.type: .* point or spot"),
        ({"fit.method": "paper_adam", "light.type": "sphere"}, "light.type: .* point or spot or led or profile with"),
        ({"light.distance": 0.1}, "light.distance: .* hung on"),
        ({"fit.method": "paper_adam", "light.mount": "ceiling"}, "light.mount: .* free"),
        ({"fit.method": "paper_adam", "light.type": "spot", "fit.shape": "free"}, "fit.shape: .* known"),
    ],
)
def test_what_does_not_fit_together_is_refused(changes: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        light_spec(with_changes(RgspipeConfig(stage="fit_light"), changes))


def test_a_measured_luminaire_is_read_and_counts_among_what_a_fit_was_made_from(tmp_path: Path) -> None:
    for name in ("a.ies", "b.ies"):
        (tmp_path / name).write_text(ies())
    plain = RgspipeConfig(stage="fit_light")
    config = with_changes(plain, {"light.type": "profile", "light.file": str(tmp_path / "b.ies")})
    assert light_spec(config).shape.table.name == "b.ies" and table_files(config) == [tmp_path / "b.ies"]
    config = with_changes(plain, {"light.type": "profile", "light.catalogue": str(tmp_path)})
    spec = light_spec(config)
    assert spec.shape_free and [one.table.name for one in spec.shape.variants()] == ["a.ies", "b.ies"]
    assert table_files(config) == [tmp_path]
    both = {"light.file": str(tmp_path / "a.ies"), "light.catalogue": str(tmp_path)}
    for changes, message in (
        (both, "null with light.file"),
        (both | {"light.type": "led"}, "null, but for light=profile or auto"),
    ):
        with pytest.raises(InputError, match=message):
            light_spec(with_changes(config, changes))
    with pytest.raises(InputError, match="no such file"):
        light_spec(with_changes(plain, {"light.type": "profile", "light.file": "missing.ies"}))


def test_lights_of_any_kind_may_be_measured_luminaires(tmp_path: Path) -> None:
    """Known cones stay known: it is not they that a catalogue leaves open."""
    for name in ("a.ies", "b.ies"):
        (tmp_path / name).write_text(ies())
    config = with_changes(RgspipeConfig(stage="fit_light"), {"light.type": "auto", "light.catalogue": str(tmp_path)})
    spec = light_spec(config)
    assert not spec.shape_free and [light.table.name for light in spec.tables] == ["a.ies", "b.ies"]
    with pytest.raises(InputError, match=r"LightSpec\.luminaires: expected none, as the type is led"):
        LightSpec("led", luminaires=spec.luminaires)


def test_what_hangs_on_a_surface_is_no_sun() -> None:
    assert "sun" in [kind.kind for kind in LightSpec("auto").kinds]
    assert "sun" not in [kind.kind for kind in LightSpec("auto", mount="ceiling").kinds]


def test_the_paper_s_method_takes_rigs_and_spots_of_known_number() -> None:
    config = with_changes(
        RgspipeConfig(stage="fit_light"), {"fit.method": "paper_adam", "light.type": "spot", "light.count": 3}
    )
    spec = light_spec(config)
    assert (spec.type, spec.count, spec.shape_free) == ("spot", 3, False)


def test_spots_are_exact_unless_harmonics_are_asked_for() -> None:
    config = RgspipeConfig(stage="fit_light")
    assert band_limit(config) is None and "fit.sh_degree" not in STAGE.keys(config)
    config = with_changes(config, {"fit.spot_basis": "sh", "fit.sh_degree": 5, "fit.sh_mirrored": False})
    assert band_limit(config) == BandLimit(5, mirrored=False)
    assert {"fit.spot_basis", "fit.sh_degree", "fit.sh_mirrored"} <= {*STAGE.keys(config)}
