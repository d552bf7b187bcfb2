"""What is looked at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from rgspipe.arguments import as_path
from rgspipe.blender.options import HotdogParameters, RoomParameters, ZooParameters
from rgspipe.datasets.input_file import input_file, input_folder, is_plain_name
from rgspipe.datasets.mesh.options import FORMATS, MeshOptions
from rgspipe.datasets.ply.options import PlyOptions
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.errors import InputError
from rgspipe.options import Options, option

#: Scenes that are modelled in code.
Modelled = Literal["cornell", "corner", "hotdog", "room", "zoo"]
MODELLED: tuple[Modelled, ...] = get_args(Modelled)

#: What `scene.path` has to be, by kind.
PATHS = {"blend": "a .blend file", "external": "a dataset's folder", "ply": "a .ply file"}
PATHS |= {"rgbd": "a capture's folder", "mesh": f"a mesh ({', '.join(FORMATS)})"}

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class CornellConfig(Options):
    """A room with two boxes, inside the unit cube: x to the right, y away from the open front, z up, floor at z = 0."""

    room: tuple[float, float, float] = option((1.0, 1.0, 1.0), low=0.1, high=1)
    """inner width, depth and height, scene units"""
    wall_color: Colour = option((0.73, 0.73, 0.73), low=0, high=1)
    """floor, ceiling and back wall, RGB reflectance"""
    left_color: Colour = option((0.65, 0.05, 0.05), low=0, high=1)
    """left wall, RGB reflectance"""
    right_color: Colour = option((0.12, 0.45, 0.15), low=0, high=1)
    """right wall, RGB reflectance"""
    box_color: Colour = option((0.73, 0.73, 0.73), low=0, high=1)
    """both boxes, RGB reflectance"""
    tall_size: tuple[float, float, float] = option((0.28, 0.28, 0.6), low=0.01, high=1)
    """tall box: width, depth, height"""
    tall_center: tuple[float, float] = option((0.33, 0.62), low=0, high=1)
    """tall box: centre of its foot, x and y"""
    tall_angle: float = option(17.2, low=-180, high=180)
    """tall box: turn about the vertical, degrees"""
    short_size: tuple[float, float, float] = option((0.28, 0.28, 0.3), low=0.01, high=1)
    """short box: width, depth, height"""
    short_center: tuple[float, float] = option((0.68, 0.35), low=0, high=1)
    """short box: centre of its foot, x and y"""
    short_angle: float = option(-17.2, low=-180, high=180)
    """short box: turn about the vertical, degrees"""
    gloss: float = option(0.0, low=0, high=1)
    """specular reflectance k_s of both boxes: a Phong lobe on their colour"""
    shininess: float = option(20.0, low=1, high=1000)
    """exponent n of that lobe"""


@dataclass(frozen=True)
class CornerConfig(Options):
    """A closed corridor around a corner: two legs, each 1 scene unit long outside."""

    width: float = option(0.32, low=0.28, high=0.36)
    """width of the corridor, scene units"""
    height: float = option(0.45, low=0.35, high=1)
    """height of the corridor, scene units"""
    wall_color: Colour = option((0.75, 0.75, 0.72), low=0, high=1)
    """walls and ceiling, RGB reflectance"""
    floor_color: Colour = option((0.55, 0.5, 0.42), low=0, high=1)
    """floor, RGB reflectance"""
    near_end_color: Colour = option((0.2, 0.35, 0.65), low=0, high=1)
    """wall at the end of the leg that the targets show, RGB reflectance"""
    far_end_color: Colour = option((0.7, 0.4, 0.15), low=0, high=1)
    """wall at the end of the other leg, RGB reflectance"""


@dataclass(frozen=True)
class SceneConfig(Options):
    """What is looked at."""

    kind: Literal[Modelled, "blend", "external", "ply", "rgbd", "mesh"] = "cornell"
    """where the scene comes from"""
    name: str | None = None
    """its name under outputs/; by default that of the file or folder"""
    path: str | None = None
    """blend, ply, mesh: the file; external: the dataset's folder; rgbd: that of a capture in another program's
    layout"""
    lamps: Literal["known", "unknown"] = "known"
    """known: each training view has one lamp of its own, which the dataset gives; unknown: some lamps were on in all
    training views alike, and they are found with the albedo (stage=capture_surfels)"""
    cornell: CornellConfig = CornellConfig()
    corner: CornerConfig = CornerConfig()
    hotdog: HotdogParameters = HotdogParameters()
    room: RoomParameters = RoomParameters()
    zoo: ZooParameters = ZooParameters()
    ply: PlyOptions = PlyOptions()
    rgbd: ScanOptions = ScanOptions()
    mesh: MeshOptions = MeshOptions()

    @property
    def folder(self) -> str:
        """The scene's folder under outputs/: `name`, or else the stem of its file, folder or kind."""
        if self.name is not None:
            return self.name
        if self.kind in MODELLED or self.path is None:
            return self.kind
        return Path(self.path).resolve().stem

    @property
    def is_capture(self) -> bool:
        """Whether it is photographs in another program's layout, with measured depth or a mesh."""
        return self.kind in ("rgbd", "mesh")

    def check(self) -> None:
        """Refuse names that are no folder of the scene's own."""
        name = self.folder
        # Blender takes a backslash for another folder.
        if name == "runs" or "\\" in name or not is_plain_name(name):
            raise InputError(
                "name",
                expected="a plain folder name other than 'runs'",
                found=repr(name),
                remedy="Set it to a name for the scene's folder.",
            )
        if self.is_capture and self.lamps == "known":
            raise InputError(
                "lamps",
                expected="unknown: no layout of a capture says where lamps were",
                found="known",
                remedy=f"Leave it away; scene={self.kind} sets it.",
            )

    def check_path(self) -> None:
        """Refuse a scene whose file or folder is not there.

        Raises:
            InputError: says what should be.
        """
        what = PATHS.get(self.kind)
        if what is None:
            return
        if self.path is None:
            remedy = f"Say which: scene={self.kind} scene.path=PATH."
            raise InputError("scene.path", expected=what, found="nothing", remedy=remedy)
        as_path(self.path, what)
        try:
            (input_folder if self.kind in ("external", "rgbd") else input_file)(self.path, what)
        except InputError as error:
            remedy = "Check scene.path; a relative path starts at the current folder."
            raise InputError(error.where, expected=what, found=error.found, remedy=remedy) from None
        suffix = Path(self.path).suffix
        if self.kind == "mesh" and suffix.lower() not in FORMATS:
            remedy = "Name the mesh, or export it as binary PLY or GLB."
            raise InputError(self.path, expected=what, found=f"the suffix {suffix!r}", remedy=remedy)
