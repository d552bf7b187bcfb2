"""What images are made of. Nothing here loads torch or Blender, so that the command line can show it at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.options import Options, option


@dataclass(frozen=True)
class BlenderOptions(Options):
    """Which Blender renders."""

    python: str | None = None
    """a Python interpreter that rgspipe is installed in with Blender's module, "rgspipe[blender]", which renders; by
    default the one that runs"""
    executable: str | None = None
    """an installed Blender, which renders instead; it takes rgspipe's packages from `python`, which has to be a
    Python of Blender's own version"""


#: The module in the Python that runs.
OWN_BLENDER = BlenderOptions()


@dataclass(frozen=True)
class DatasetOptions(Options):
    """How images are made; unused where they are given."""

    resolution: int = option(128, low=8, high=8192)
    """image width and height, pixels"""
    train_views: int = option(100, low=1, high=100000)
    """training views, each with one light of its own"""
    test_views: int = option(24, low=1, high=100000)
    """held-out views: new cameras and new lights"""
    targets_per_class: int = option(20, low=0, high=10000)
    """fit targets of each occlusion class that suits the scene"""
    target_views: int = option(3, low=1, high=3)
    """fixed cameras that see each fit target"""
    lamps: int = option(2, low=1, high=8)
    """lamps that are on in all training views alike, where these are unknown"""
    samples: int = option(48, low=1, high=1000000)
    """paths per pixel of training views and targets"""
    test_samples: int = option(192, low=1, high=1000000)
    """paths per pixel of held-out views: with 48 their noise hides 2 dB"""
    denoise: bool = True
    """denoise the colour images"""
    max_bounces: int = option(128, low=0, high=1024)
    """bounces of a path; n lose up to albedo^(n + 1) of a closed room's light: 12 about 15 % where walls are 0.88"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of cameras and lights; each frame draws from its own stream, and does not depend on how many there are"""


@dataclass(frozen=True)
class HotdogParameters(Options):
    """A hot dog on a plate, in empty space."""

    textured: bool = True
    """textures on bun and sausage; without them every part has one colour"""
    segments: int = option(192, low=48, high=2000)
    """faces around plate and bun; normals of smooth surfaces turn by half of 360°/segments in a face"""


@dataclass(frozen=True)
class RoomParameters(Options):
    """A closed room with a table, a bookcase, an armchair and ten other things."""

    textured: bool = True
    """textures on floor, walls and furniture; without them every part has one colour"""
    segments: int = option(192, low=48, high=2000)
    """faces around whatever is round"""


@dataclass(frozen=True)
class ZooParameters(Options):
    """A room that nobody tuned: plan, furniture, colours and cameras are drawn from a seed."""

    seed: int = option(0, low=0, high=2**31 - 1)
    """which room"""
    plan: Literal["any", "box", "l", "t", "alcove", "two_rooms"] = "any"
    """its floor; any draws it"""
    tone: Literal["any", "white", "dark", "mixed"] = "any"
    """its colours: albedo 0.85 to 0.95, 0.02 to 0.3, or 0.1 to 0.9; any draws which"""
    fronts: Literal["any", "closed", "open"] = "any"
    """whether one wall is missing; only a box and an alcove may be open"""
    views: Literal["any", "standing", "one_side"] = "any"
    """where cameras stand: among the furniture, or all along one side"""
    lens: float | None = option(None, low=5, high=150)
    """field of view of its cameras, degrees; drawn between 30 and 75 if null"""
