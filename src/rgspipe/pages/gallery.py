"""Pictures of a dataset: what training saw, what the targets of each class look like, and where everything is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rgspipe.datasets.views import Target, View
from rgspipe.evaluation import images
from rgspipe.evaluation.classes import class_order
from rgspipe.pages.html import label
from rgspipe.scene import LightRig

#: Training views that are shown, and targets of each class.
SHOWN_VIEWS, SHOWN_TARGETS = 6, 2

#: What each class of targets is, in words.
CLASSES = {
    "visible": "The picture shows the light’s own place.",
    "out_of_frame": "The light is outside the picture; nothing hides it.",
    "occluded": "Something stands between the camera and the light.",
    "around_corner": "The light is around a corner: it reaches what the camera sees only by bouncing.",
    "mixed": "Several lights, which are of different classes.",
    "unknown": "Nothing is known of where the light is.",
}


@dataclass(frozen=True)
class Shot:
    """One picture, the words under it, and what it shows for those who cannot see it."""

    caption: str
    alt: str
    png: bytes


@dataclass(frozen=True)
class TargetClass:
    """The targets of one class: how many there are, and pictures of some."""

    name: str
    words: str
    count: int
    shots: tuple[Shot, ...]


@dataclass(frozen=True)
class Gallery:
    """Pictures of a dataset.

    Attributes:
        counts: how many views and targets there are, in words.
        train: some training views.
        classes: the targets by class.
        plan: a PNG of cameras and lights in the scene, or None.
    """

    counts: str
    train: tuple[Shot, ...]
    classes: tuple[TargetClass, ...]
    plan: bytes | None = None


def make_gallery(
    train: Sequence[View],
    held_out: int | None,
    targets: Sequence[Target],
    truths: Mapping[str, LightRig],
    errors: Mapping[str, float],
    plan: bytes | None = None,
) -> Gallery:
    """The pictures of a dataset.

    Args:
        train: the training views.
        held_out: how many held-out views there are; None if that is not known.
        targets: the fit targets.
        truths: the true lights of targets by name, as far as they are known.
        errors: position error of the recovered light by target, fraction of the scene's size, as far as known.
        plan: PNG of where cameras and lights are.
    """
    shown = spread(len(train), SHOWN_VIEWS)
    shots = tuple(_train_shot(train[index]) for index in shown)
    classes = tuple(_target_class(name, targets, truths, errors) for name in class_order(_classes(targets)))
    return Gallery(_counts(train, held_out, targets), shots, classes, plan)


def picture(view: View) -> bytes:
    """A view as PNG, exposed for itself."""
    return images.png_bytes(images.tone_map(view.image, images.display_gain(view.image)))


def light_words(rig: LightRig) -> str:
    """Where lights are and how strong: "light at (0.10, 0.20, 0.30), 1.0 / 1.0 / 0.9 W/sr"; spots say so."""
    parts = []
    for light in rig:
        place = ", ".join(f"{value:.2f}" for value in (light.axis if light.distant else light.position).tolist())
        strength = " / ".join(f"{value:.2f}" for value in light.intensity.tolist())
        kind, where = "light" if light.axis is None else light.kind, "along" if light.distant else "at"
        parts.append(f"{kind} {where} ({place}), {strength} {light.unit}")
    return "; ".join(parts).replace("-", "−")


def spread(count: int, wanted: int) -> list[int]:
    """Up to `wanted` indices below `count`, evenly spread."""
    return sorted(set(np.linspace(0, count - 1, min(count, wanted)).round().astype(int).tolist())) if count else []


def _train_shot(view: View) -> Shot:
    name = view.name.rpartition("/")[2]
    words = "" if view.light is None else light_words((view.light,))
    return Shot(f"{name}: {words}" if words else name, f"training view {name}", picture(view))


def _target_class(
    name: str, targets: Sequence[Target], truths: Mapping[str, LightRig], errors: Mapping[str, float]
) -> TargetClass:
    members = [target for target in targets if target.occlusion == name]
    shots = tuple(_target_shot(target, truths, errors) for target in members[:SHOWN_TARGETS])
    return TargetClass(name, CLASSES.get(name, ""), len(members), shots)


def _target_shot(target: Target, truths: Mapping[str, LightRig], errors: Mapping[str, float]) -> Shot:
    rig = truths.get(target.name)
    words = [light_words(rig) if rig else "true light not known"]
    if np.isfinite(errors.get(target.name, np.nan)):
        words.append(f"recovered {100.0 * errors[target.name]:.2f} % away")
    alt = f"target {target.name}, {label(target.occlusion)}, as its first camera sees it"
    return Shot(f"{target.name}: {'; '.join(words)}", alt, picture(target.views[0]))


def _classes(targets: Iterable[Target]) -> list[str]:
    return [target.occlusion for target in targets]


def _counts(train: Sequence[View], held_out: int | None, targets: Sequence[Target]) -> str:
    parts = []
    if train:
        height, width = train[0].image.shape[:2]
        parts.append(f"{_many(len(train), 'training view')} of {width} × {height} pixels")
    if held_out is not None:
        parts.append(_many(held_out, "held-out view"))
    if targets:
        parts.append(f"{_many(len(targets), 'target')} with {_many(len(targets[0].views), 'view')} each")
    return ", ".join(parts)


def _many(count: int, name: str) -> str:
    return f"{count} {name}{'s' if count != 1 else ''}"
