"""What a fit leaves on disk for one target: its light file, its course, and pictures of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from rgspipe.datasets.exr import write_image
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.views import as_photographed
from rgspipe.evaluation.images import Bytes, line_of_text, progress_strip, save_png, stack
from rgspipe.evaluation.metrics import psnr
from rgspipe.fitting.fit import FitViews
from rgspipe.fitting.in_sight.lamp import Mask, left_out
from rgspipe.fitting.result import FitResult, Step
from rgspipe.scene import LightRig
from rgspipe.store.files import publish, remove_tree, write_bytes, write_text

#: What the light file says beside the lights, and results.csv repeats.
FIELDS = ("loss", "iterations", "evaluations", "lights_tried", "seconds", "psnr", "result", "reason")

#: What an image that is equal to the last bit gets, so that the number can be written as JSON; float32 images that
#: differ at all stay below it.
BEST_PSNR = 200.0


def write_result(
    folder: Path,
    result: FitResult,
    views: FitViews,
    targets: Sequence[Tensor],
    further: Mapping[str, bytes] | None = None,
    words: Callable[[str], str] = str,
    there: Sequence[Tensor] | None = None,
    saturated: Sequence[Tensor] | None = None,
) -> None:
    """Write lights.json, convergence.csv, fit.png and final.exr; `folder` appears when it is whole, in place of any.

    fit.png has one row a view: target, start, midway, end, difference. final.exr is the first view's
    final image; those of further views are final_1.exr and so on. Where pixels of lamps in sight were left out, they
    are outlined in fit.png, and emitters.png, emitters_1.png and so on are their masks. `further` holds more files by
    name; the reason is told in these `words`. `there` is what every view shows besides the lights, if
    that was looked for or given: it stands in all images of the fit, and in fit.png by itself beside the target.
    Where targets are `saturated`, (H, W, 3) bool a view, fit.png and the PSNR take renders as the camera would have.
    """
    partial = folder.with_name(f".{folder.name}.partial")
    remove_tree(partial)
    partial.mkdir(parents=True)
    shown = [_with(views.render(rig), there) for rig in _milestones(result)]
    final = shown[-1]
    shown = [_photographed(images, targets, saturated) for images in shown]
    masks = left_out(result.lamps, [image.shape[:2] for image in final]) if result.lamps else None
    result.save(partial / "lights.json", words, psnr=_psnr(shown[-1], targets, masks))
    _write_convergence(partial / "convergence.csv", result.trajectory)
    save_png(partial / "fit.png", _picture(targets, [*([there] if there else []), *shown], masks))
    for index, mask in enumerate(masks or ()):
        save_png(partial / _numbered("emitters", index, "png"), np.repeat(255 * mask.astype(np.uint8)[..., None], 3, 2))
    for index, image in enumerate(final):
        write_image(partial / _numbered("final", index, "exr"), image.cpu().numpy())
    for name, content in (further or {}).items():
        write_bytes(partial / name, content)
    remove_tree(folder)
    publish(partial, folder)


def _with(images: Sequence[Tensor], there: Sequence[Tensor] | None) -> list[Tensor]:
    """Images of lights with what is there besides."""
    return [image + other.to(image) for image, other in zip(images, there, strict=True)] if there else [*images]


def _photographed(
    images: Sequence[Tensor], targets: Sequence[Tensor], saturated: Sequence[Tensor] | None
) -> Sequence[Tensor]:
    """Renders as a camera that clips as the targets' did would have taken them."""
    if saturated is None:
        return images
    cpu = [image.detach().cpu() for image in images]
    return [as_photographed(*one) for one in zip(cpu, targets, saturated, strict=True)]


def read_result(folder: Path) -> dict[str, object]:
    """The row of results.csv of one target: x … b of its first light (empty without one) and `FIELDS`."""
    path = folder / "lights.json"
    content, lights = read_json(path, "a fit's light file"), read_lights(path)
    values = [*lights[0].position.tolist(), *lights[0].intensity.tolist()] if lights else [None] * 6
    return dict(zip("xyzrgb", values, strict=True)) | {name: content[name] for name in FIELDS}


def _milestones(result: FitResult) -> list[LightRig]:
    """The rigs at the start, midway and at the end."""
    steps = result.trajectory
    if not steps or not result.lights:
        return [(), (), ()]
    return [steps[0].lights, steps[len(steps) // 2].lights, result.lights]


def _picture(targets: Sequence[Tensor], shown: Sequence[Sequence[Tensor]], masks: Sequence[Mask] | None) -> Bytes:
    """One row a view, and a line that says what is outlined if anything is."""
    rows = [
        progress_strip(target, [images[k] for images in shown], None if masks is None else masks[k])
        for k, target in enumerate(targets)
    ]
    return stack(
        rows if masks is None else [*rows, line_of_text("lamps in sight: left out of the fit", rows[0].shape[1])]
    )


def _numbered(name: str, index: int, suffix: str) -> str:
    """The name of the file of a view: that of the first one has no number."""
    return f"{name}.{suffix}" if index == 0 else f"{name}_{index}.{suffix}"


def _psnr(images: Sequence[Tensor], targets: Sequence[Tensor], masks: Sequence[Mask] | None) -> float | None:
    """PSNR over all pixels of all views but those of lamps, at most BEST_PSNR; None where it has no meaning."""
    kept = [torch.ones(image.shape[:2], dtype=torch.bool) for image in images]
    if masks is not None:
        kept = [torch.from_numpy(~mask) for mask in masks]
    joined = [
        torch.cat([image.detach().cpu()[chosen].reshape(-1, 1, 3) for image, chosen in zip(group, kept, strict=True)])
        for group in (images, targets)
    ]
    value = psnr(*joined)
    return None if math.isnan(value) else min(value, BEST_PSNR)


def _write_convergence(path: Path, steps: Sequence[Step]) -> None:
    """One row a step: step, loss, the lights and seconds. Columns of the second light end in _1, and so on."""
    rows = [
        {"step": index, "loss": step.loss} | _light_columns(step.lights) | {"seconds": round(step.seconds, 4)}
        for index, step in enumerate(steps)
    ]
    empty = ["step", "loss", *"xyzrgb", "seconds"]
    write_text(path, pd.DataFrame(rows, columns=list(rows[0]) if rows else empty).to_csv(index=False))


def _light_columns(rig: LightRig) -> dict[str, float]:
    """`Light.columns` of every light."""
    columns: dict[str, float] = {}
    for index, light in enumerate(rig):
        columns |= {name if index == 0 else f"{name}_{index}": value for name, value in light.columns().items()}
    return columns
