"""Write lights in the formats of other programs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import get_args

from torch import Tensor

from rgspipe.arguments import as_path, as_several
from rgspipe.datasets.light_file import WORLD, ambient_fields, write_lights
from rgspipe.errors import InputError
from rgspipe.light_export.blend import blend
from rgspipe.light_export.gltf import gltf
from rgspipe.light_export.ies import ies
from rgspipe.light_export.limits import check_range, check_world
from rgspipe.light_export.mitsuba import mitsuba
from rgspipe.light_export.parts import Numbered, is_of_another_shape, is_told
from rgspipe.light_export.three import three
from rgspipe.light_export.usd import usda
from rgspipe.light_export.world import World, table
from rgspipe.names import LightFormat
from rgspipe.scene import Light, LightRig
from rgspipe.scene.lights import ProfileLight, as_rig
from rgspipe.store.files import write_text

FORMATS: tuple[LightFormat, ...] = get_args(LightFormat)

#: Files of formats that hold all lights in one.
NAMES = {"blend": "lamps_blender.py", "usda": "lamps.usda", "gltf": "lamps.gltf"}
NAMES |= {"mitsuba": "lamps_mitsuba.xml", "three": "lamps_three.json", "json": "lamps.json"}

#: Said of light that is no lamp's.
AROUND = (
    "With them came light from all around, ({}) W/(sr·m²), which JSON alone holds: give it to the world "
    "(Blender: World > Background, strength 1), or renders are too dark."
)

_WRITERS: dict[str, Callable[[Numbered], tuple[str, list[str]]]] = {
    "usda": usda,
    "gltf": gltf,
    "mitsuba": mitsuba,
    "three": three,
}


@dataclass(frozen=True)
class LightExport:
    """What was written.

    Attributes:
        files: in the order of the formats.
        lines: for people: what was done to the lights, and what a format does not hold.
    """

    files: tuple[Path, ...]
    lines: tuple[str, ...]


def export_lights(
    lights: Light | Sequence[Light],
    folder: str | Path,
    formats: Sequence[LightFormat] = FORMATS,
    *,
    metres: float = 1.0,
    world: World | None = None,
    covariances: Sequence[Tensor | None] = (),
    ambient: Tensor | None = None,
    notes: Sequence[str] = (),
) -> LightExport:
    """Write lights into `folder` for other programs: a file a format, and lamps.txt with their units.

    Args:
        formats: blend (a script for Blender), usda, gltf, mitsuba (XML), three (JSON), ies (a file a light), json.
        metres: per scene unit.
        world: how scene units came about, instead of `metres`.
        covariances: of each light, of which the first three rows are its place [scene units²].
        ambient: (3,) radiance that came from all around beside them; json alone holds it.
        notes: further lines for lamps.txt, such as what the fit doubted.

    Raises:
        InputError: an unknown format, a unit that is none, or a light that a format cannot hold.
    """
    world = world or World(metres)
    check_world(world)
    formats = as_several(formats, str, "formats", f"Pass some of {', '.join(FORMATS)}.")
    for name in formats:
        if name not in FORMATS:
            raise InputError("formats", expected=" or ".join(FORMATS), found=repr(name), remedy="Correct the name.")
    rig, folder = world.lights(as_rig(lights)), as_path(folder, "folder")
    check_range(rig)
    regions = [None if one is None else world.unit**2 * one[:3, :3] for one in covariances]
    told = {number: light for number, light in enumerate(rig, start=1) if is_told(light)}
    made = [file for name in formats for file in _texts(name, told, folder, regions)]
    folder.mkdir(parents=True, exist_ok=True)
    for path, text, _ in made:
        if text is None:
            moved = {} if world == World() else {WORLD: asdict(world)}
            write_lights(path, rig, {"units": "metres, W/sr; of suns W/m²"} | moved | ambient_fields(ambient))
        else:
            write_text(path, text)
    notes = [*notes, *(note for _, _, said in made for note in said), *_lost(rig, {*formats})]
    if ambient is not None and {*formats} != {"json"}:
        notes.append(AROUND.format(", ".join(f"{value:.4g}" for value in ambient.tolist())))
    if "blend" in formats and world.metres != 1.0:
        notes.append(f"{NAMES['blend']} is in metres: for a file whose unit is another, export it with metres=1.")
    write_text(folder / "lamps.txt", f"{world.line()}\n\n{table(rig)}" + "".join(f"{note}\n" for note in notes))
    return LightExport(tuple(path for path, _, _ in made), (world.line(), *notes))


def _texts(
    name: str, lights: Numbered, folder: Path, regions: Sequence[Tensor | None]
) -> list[tuple[Path, str | None, list[str]]]:
    """Files of a format, each with its text (None for a light file) and what it does not hold."""
    if name == "ies":
        named = [(f"lamp_{number}", light) for number, light in lights.items()]
        return [(folder / f"{stem}.ies", *ies(light, stem)) for stem, light in named if not light.distant]
    if name == "json":
        return [(folder / NAMES[name], None, [])]
    return [(folder / NAMES[name], *(blend(lights, regions) if name == "blend" else _WRITERS[name](lights)))]


def _lost(rig: LightRig, formats: set[str]) -> list[str]:
    """What several formats do not hold."""
    numbered, others, notes = [*enumerate(rig, start=1)], formats - {"json"}, []
    if "ies" in formats:
        notes += [f"light {n}: LM-63 has no suns; it is left out." for n, one in numbered if one.distant]
    if others - {"ies"}:
        notes += [
            f"light {n}: the {one.label} is written as its mean around the axis; IES and JSON hold all of it."
            for n, one in numbered
            if isinstance(one, ProfileLight) and not one.round
        ]
    for n, one in numbered if others else ():
        if not is_told(one):
            notes.append(f"light {n}: where a {one.label} shines no other program is told; JSON alone holds it.")
        elif is_of_another_shape(one):
            notes.append(f"light {n}: the {one.label} is written without its extent; JSON holds all of it.")
    return notes
