"""The lamps of a capture as a light file, with what is not known of them."""

from __future__ import annotations

from pathlib import Path

import torch

from rgspipe.capture.captured import Captured
from rgspipe.datasets.covariance_file import covariance_fields
from rgspipe.datasets.light_file import write_lights


def write_lamps(path: Path, found: Captured) -> None:
    """Write a light file with the covariance of each place [scene units²] and the relative error of each intensity."""
    certainty = found.certainty
    covariances = [torch.from_numpy(covariance) for covariance in certainty.places]
    lamps = covariance_fields(len(found.lamps), {"covariance": covariances})
    for fields, gains, guess in zip(lamps, certainty.gains.tolist(), found.guesses.tolist(), strict=True):
        fields |= {"intensity_error": gains, "guess": guess}
    extra = {
        "lights": lamps,
        "scale_error": certainty.scale,
        "scale_tied": certainty.is_tied,
        "bounced": certainty.bounced,
    }
    write_lights(path, found.lamps, extra)
