"""What a report shows of a scene that was captured under unknown lamps: these, and what is to be thought of them."""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatch

import torch

from rgspipe.datasets.covariance_file import read_covariances
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.pages.html import decimals
from rgspipe.pages.room_view import LampMark
from rgspipe.pages.section import Section
from rgspipe.scene import Light, LightRig
from rgspipe.store.artifacts import Artifact

TITLE = "The lamps that were on"

NOTE = (
    "Behind ± is one standard deviation of the place along an axis. No photograph tells a watt: intensities are right "
    "among each other, and all of them up to the factor by which the photographs’ values are radiance."
)


def captured_lamps(trained: Artifact | None) -> LightRig:
    """All lamps that a capture found; none of a scene whose lamps were known."""
    return tuple(light for _, light, _ in _lamps(trained))


def captured_section(trained: Artifact | None) -> list[Section]:
    """The lamps of a capture by its lightings, with the words of each; nothing of a scene whose lamps were known.

    Args:
        trained: what made the surfels.
    """
    if not _files(trained):
        return []
    measured = read_json(trained.file("metrics.json"), "the measures of a capture")
    words = []
    for name in _files(trained):
        lighting = _lighting(name)
        own = measured.get("others", {}).get(lighting, measured)
        words.append(f"{lighting}: {own['words']}" if lighting else str(own["words"]))
    rows = [_row(name, light, spread) for name, light, spread in _lamps(trained)]
    columns = ["<Lamp", "<Kind", "<Place (x, y, z)", "±", "R / G / B (W/sr)"]
    return [Section("lamps", TITLE, words, columns, rows, NOTE)]


def captured_marks(trained: Artifact | None) -> list[LampMark]:
    """The lamps of a capture, as the room of a report draws them."""
    return [
        LampMark(
            f"lamp {name}",
            light.position.double().numpy(),
            None if spread is None else spread[:3, :3].double().numpy(),
            "± not known" if spread is None else f"± {_spread(spread)} an axis",
        )
        for name, light, spread in _lamps(trained)
    ]


def _lamps(trained: Artifact | None) -> Iterator[tuple[str, Light, torch.Tensor | None]]:
    """Each lamp with its name, such as "evening 1" or "1", and the covariance of what is known of it."""
    for file in _files(trained):
        path = trained.file(file)
        rig = read_lights(path)
        spreads = read_covariances(path) or (None,) * len(rig)
        for number, (light, spread) in enumerate(zip(rig, spreads, strict=True), start=1):
            yield f"{_lighting(file)} {number}".strip(), light, spread


def _row(name: str, light: Light, spread: torch.Tensor | None) -> list[str]:
    place = ", ".join(decimals(float(value), 2) for value in light.position)
    strength = " / ".join(decimals(float(value), 2) for value in light.intensity)
    return [name, light.label, place, _spread(spread), strength]


def _lighting(file: str) -> str:
    """Of `lamps_evening.json` "evening"; of `lamps.json`, which has no name, ""."""
    return file.removesuffix(".json").removeprefix("lamps").removeprefix("_")


def _files(trained: Artifact | None) -> list[str]:
    files = () if trained is None else trained.manifest["files"]
    return sorted(name for name in files if fnmatch(name, "lamps*.json"))


def _spread(covariance: torch.Tensor | None) -> str:
    """Standard deviation of a coordinate, the mean over the axes."""
    if covariance is None:
        return "—"
    return decimals(float(covariance[:3, :3].diagonal().mean().sqrt()), 3)
