"""What is to be rendered: plain values that travel to Blender's process as JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

from rgspipe.blender.models.parameters import Model, kind_of, model_from_json
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
class DatasetJob:
    """One dataset.

    Attributes:
        scene: name of the scene, written into dataset_info.json.
        model: what is rendered: the measures of a scene of our own, or the user's .blend file.
        train_views, test_views: images with one known light each.
        targets_per_class: fit targets of each class that suits the scene.
        target_views: cameras that see every target, 1 to 3.
        resolution: width and height of every image, pixels.
        samples: Cycles samples a pixel of training views and targets.
        test_samples: the same of held-out views: what judges must be better than what is judged.
        denoise: whether Open Image Denoise runs over the result.
        max_bounces: bounces of light that Cycles follows.
        light_clearance: least distance of training, test and ordinary target lights from any surface.
        hidden_light_clearance: the same for targets of the class "occluded".
        seed: of every random draw; each frame draws from its own stream, so that frame k does not
            depend on how many there are.
    """

    scene: str = "cornell"
    model: Model = field(default_factory=CornellBox)
    train_views: int = 100
    test_views: int = 24
    targets_per_class: int = 20
    target_views: int = 3
    resolution: int = 128
    samples: int = 48
    test_samples: int = 192
    denoise: bool = True
    max_bounces: int = 12
    light_clearance: float = 0.08
    hidden_light_clearance: float = 0.05
    seed: int = 0

    def __post_init__(self) -> None:
        least = {"train_views": 0, "test_views": 0, "targets_per_class": 0, "resolution": 1}
        least |= {"samples": 1, "test_samples": 1}
        for name, lowest in least.items():
            if getattr(self, name) < lowest:
                raise ValueError(f"{name} must be at least {lowest}, got {getattr(self, name)}")
        if not 1 <= self.target_views <= 3:
            raise ValueError(f"target_views must be 1, 2 or 3, got {self.target_views}")

    @property
    def settings(self) -> RenderSettings:
        """The quality of its images."""
        return RenderSettings(self.resolution, self.samples, self.denoise, self.max_bounces)

    def to_json(self) -> dict:
        return asdict(self) | {"kind": kind_of(self.model)}

    @classmethod
    def from_json(cls, content: dict) -> DatasetJob:
        """The job that `to_json` described."""
        values = dict(content)
        model = model_from_json(values.pop("kind"), values.pop("model"))
        return cls(**values, model=model)
