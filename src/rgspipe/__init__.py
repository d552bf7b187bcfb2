"""rgspipe: from images of a scene, find the lights."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from rgspipe.threads import settle_threads

if TYPE_CHECKING:
    from rgspipe.fitting import fit_lights
    from rgspipe.renderer.frozen import FrozenScene
    from rgspipe.scene import PointLight, SpotLight

__all__ = ["FrozenScene", "PointLight", "SpotLight", "__version__", "fit_lights"]

settle_threads()

__version__ = "0.1.0"

#: Where the public names live; they are imported when first used, so that `import rgspipe` stays quick.
_HOMES = {
    "FrozenScene": "rgspipe.renderer.frozen",
    "PointLight": "rgspipe.scene",
    "SpotLight": "rgspipe.scene",
    "fit_lights": "rgspipe.fitting",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
