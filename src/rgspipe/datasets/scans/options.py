"""What a capture in another program's layout leaves open. Nothing here loads torch, for the command line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from rgspipe.options import Options, option

#: Layouts that are read.
Layout = Literal[
    "nerfstudio", "polycam", "colmap", "replica", "scannet", "iid", "interiorverse", "openrooms",
    "tum", "7scenes", "arkitscenes",
]  # fmt: skip
LAYOUTS: tuple[Layout, ...] = get_args(Layout)


@dataclass(frozen=True)
class ScanOptions(Options):
    """How a capture in the layout of another program is read."""

    format: Literal[Layout, "auto"] = "auto"
    """the layout; auto: told by the files that are there"""
    missing: Literal["refuse", "leave_out"] = "refuse"
    """photographs of which a file is not there, as nerfstudio, Polycam, COLMAP and others list them: refused, or left
    out and told"""
    frames: int = option(60, low=1, high=100_000)
    """at most so many photographs, evenly spaced"""
    resolution: int = option(160, low=8, high=8192)
    """pixels along the longer side that photographs are reduced to"""
    response: Literal["srgb", "linear"] = "srgb"
    """how levels of PNG and JPEG photographs rise with light; EXR is linear, and albedo maps in levels are sRGB"""
    exposure: Literal["exif", "same"] = "exif"
    """exif: photographs are made alike by shutter, aperture and ISO where all of them state them, and refused where
    some do and differ; same: taken as they are"""
    axes: Literal["layout", "opengl", "opencv"] = "layout"
    """axes of the cameras, where files do not keep to their layout: y up and z backwards, or y down and z forwards"""
    depth_unit: float | None = option(None, low=1e-9, high=1e9)
    """metres of 1 in a depth image, where files do not keep to their layout"""
    pose_unit: float | None = option(None, low=1e-9, high=1e9)
    """metres of 1 in the cameras' places; by default 1"""
    fov: float | None = option(None, low=3.2, high=179)
    """horizontal field of view of photographs whose files do not state it (iid, interiorverse, openrooms, tum,
    replica with traj_w_c.txt), degrees, of which less than 3.2 would be radians; by default the layout's usual one"""
    others: tuple[str, ...] = ()
    """folders of further captures of the same room under other lamps, in the same layout and coordinates"""
    lamps_off: str | None = None
    """folder of such a capture with the lamps off: daylight, screens"""
    photograph: str | None = None
    """which one, of photographs without poses that lie in one folder (iid, interiorverse): its file's name, with or
    without suffix"""

    def camera_axes(self, usual: str) -> str:
        """Axes of the cameras in the files of a layout that has these."""
        return usual if self.axes == "layout" else self.axes
