"""What a report shows of a scene that was captured under unknown lamps: these, and what is to be thought of them."""

from __future__ import annotations

from fnmatch import fnmatch

import torch

from rgspipe.datasets.covariance_file import read_covariances
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.pages.html import decimals
from rgspipe.pages.section import Section
from rgspipe.scene import LightRig
from rgspipe.store.artifacts import Artifact

TITLE = "The lamps that were on"

NOTE = (
    "Behind ± is one standard deviation of the place along an axis. No photograph tells a watt: intensities are right "
    "among each other, and all of them up to the factor by which the photographs’ values are radiance."
)


def captured_lamps(trained: Artifact | None) -> LightRig:
    """All lamps that a capture found; none of a scene whose lamps were known."""
    return tuple(light for name in _files(trained) for light in read_lights(trained.file(name)))


def captured_section(trained: Artifact | None) -> list[Section]:
    """The lamps of a capture by its lightings, with the words of each; nothing of a scene whose lamps were known.

    Args:
        trained: what made the surfels.
    """
    if not _files(trained):
        return []
    measured = read_json(trained.file("metrics.json"), "the measures of a capture")
    words, rows = [], []
    for name in _files(trained):
        lighting = name.removesuffix(".json").removeprefix("lamps").removeprefix("_")
        own = measured.get("others", {}).get(lighting, measured)
        words.append(f"{lighting}: {own['words']}" if lighting else str(own["words"]))
        path = trained.file(name)
        rig = read_lights(path)
        spreads = read_covariances(path) or (None,) * len(rig)
        for number, (light, spread) in enumerate(zip(rig, spreads, strict=True), start=1):
            place = ", ".join(decimals(float(value), 2) for value in light.position)
            strength = " / ".join(decimals(float(value), 2) for value in light.intensity)
            rows.append([f"{lighting} {number}".strip(), light.label, place, _spread(spread), strength])
    columns = ["<Lamp", "<Kind", "<Place (x, y, z)", "±", "R / G / B (W/sr)"]
    return [Section("lamps", TITLE, words, columns, rows, NOTE)]


def _files(trained: Artifact | None) -> list[str]:
    files = () if trained is None else trained.manifest["files"]
    return sorted(name for name in files if fnmatch(name, "lamps*.json"))


def _spread(covariance: torch.Tensor | None) -> str:
    """Standard deviation of a coordinate, the mean over the axes."""
    if covariance is None:
        return "—"
    return decimals(float(covariance[:3, :3].diagonal().mean().sqrt()), 3)
