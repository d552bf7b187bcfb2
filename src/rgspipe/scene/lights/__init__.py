"""Kinds of light, one file each, in scene units and W/sr."""

from rgspipe.scene.lights.axial import AxialLight
from rgspipe.scene.lights.led import LedLight
from rgspipe.scene.lights.light import WATTS_PER_INTENSITY, Light, RelativeIntensity
from rgspipe.scene.lights.nodes import Nodes
from rgspipe.scene.lights.panel import PanelLight
from rgspipe.scene.lights.photometry import Photometry
from rgspipe.scene.lights.point import PointLight
from rgspipe.scene.lights.profile import ProfileLight
from rgspipe.scene.lights.rig import LightRig, as_rig, check_numbers
from rgspipe.scene.lights.shape_number import ShapeNumber
from rgspipe.scene.lights.sphere import SphereLight
from rgspipe.scene.lights.spot import SpotLight
from rgspipe.scene.lights.sun import SunLight

#: Every kind by its name.
KINDS: dict[str, type[Light]] = {
    kind.kind: kind for kind in (PointLight, SpotLight, LedLight, SphereLight, PanelLight, SunLight, ProfileLight)
}

__all__ = [
    "KINDS",
    "WATTS_PER_INTENSITY",
    "AxialLight",
    "LedLight",
    "Light",
    "LightRig",
    "Nodes",
    "PanelLight",
    "Photometry",
    "PointLight",
    "ProfileLight",
    "RelativeIntensity",
    "ShapeNumber",
    "SphereLight",
    "SpotLight",
    "SunLight",
    "as_rig",
    "check_numbers",
]
