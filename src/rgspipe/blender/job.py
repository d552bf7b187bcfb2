"""What is to be rendered: plain values that travel to Blender's process as JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

from rgspipe.blender.models.parameters import Model, kind_of, model_from_json
from rgspipe.blender.options import DatasetOptions
from rgspipe.options import option
from rgspipe.scene.models import CornellBox


@dataclass(frozen=True)
class RenderSettings:
    """What decides the quality of an image.

    Attributes:
        resolution: width and height, pixels.
        samples: Cycles samples a pixel.
        denoise: whether Open Image Denoise runs over the result.
        max_bounces: bounces of light that Cycles follows; 0 is direct light alone.
    """

    resolution: int
    samples: int
    denoise: bool
    max_bounces: int


@dataclass(frozen=True)
class DatasetJob(DatasetOptions):
    """One dataset; a pool of lights has no views of its own."""

    scene: str = "cornell"
    """name of the scene, written into dataset_info.json"""
    model: Model = field(default_factory=CornellBox)
    """what is rendered: the measures of a scene of our own, or the user's .blend file"""
    train_views: int = option(100, low=0, high=100000)
    """images with one known light each"""
    test_views: int = option(24, low=0, high=100000)
    """the same, held out: what judges must be better than what is judged, so it has samples of its own"""
    light_clearance: float = option(0.08, low=0, high=1)
    """least distance of training, test and ordinary target lights from any surface"""
    hidden_light_clearance: float = option(0.05, low=0, high=1)
    """the same for occluded targets"""
    lamps_known: bool = True
    """whether each training view has one known lamp of its own; or else `lamps` are on in all of them, and unknown"""

    @property
    def settings(self) -> RenderSettings:
        """The quality of its images."""
        return RenderSettings(self.resolution, self.samples, self.denoise, self.max_bounces)

    def to_json(self) -> dict:
        """Everything of the job, as JSON has it."""
        return asdict(self) | {"kind": kind_of(self.model)}

    @classmethod
    def from_json(cls, content: dict) -> DatasetJob:
        """The job that `to_json` described."""
        values = dict(content)
        model = model_from_json(values.pop("kind"), values.pop("model"))
        return cls(**values, model=model)
