"""The true rigs of fit targets in the frozen scene, beside the images of those targets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.exr import read_image
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.views import Target
from rgspipe.errors import InputError
from rgspipe.evaluation.plots import png_of
from rgspipe.progress import progress_bar
from rgspipe.relighting.pictures import Relit, comparison_figure
from rgspipe.relighting.sweeps import spread_frames
from rgspipe.relighting.table import compared, relight_summary, typical_rows
from rgspipe.scene import LightRig
from rgspipe.stages.base import Need, StageContext
from rgspipe.stages.relight.scene import Relighter, chosen_indices, image_path, target_folders
from rgspipe.stages.sources import has_truth, target_stage
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import write_bytes, write_text

COMPARISON, SUMMARY = "comparison.png", "summary.csv"


def relight_targets(context: StageContext, relighter: Relighter) -> pd.DataFrame:
    """Write images/, lights/, summary.csv and comparison.png; a row an image.

    Raises:
        InputError: no target has a true rig.
    """
    rows, truths = [], {}
    for target, rig in progress_bar(list(_targets(context)), "relighting targets", unit="target"):
        indices = chosen_indices(context.config.relight.indices, len(target.views))
        views = [(index, target.views[index].camera) for index in indices]
        written, images = relighter.write(context.folder, target.name, rig, views)
        for row, image, index in zip(written, images, indices, strict=True):
            truth = target.views[index].image.numpy()
            truths[target.name, index] = truth
            rows.append(row | compared(image, truth))
    table = pd.DataFrame(rows)
    summary = relight_summary(table)
    write_text(context.folder / SUMMARY, summary.to_csv(index=False))
    shown = []
    for row in table.loc[typical_rows(table)].to_dict("records"):
        render, _ = read_image(image_path(context.folder, row["rig"], row["view"]))
        shown.append(Relit(row["lights"], truths[row["rig"], row["view"]], render, row["psnr"]))
    if shown:
        # A dataset may hold photographs as well.
        name = "path traced" if has_truth(context.config) else "target"
        write_bytes(context.folder / COMPARISON, png_of(comparison_figure(shown, name)))
    context.note(psnr=dict(zip(summary["lights"].astype(str), summary["psnr"].round(2), strict=True)))
    return table


def target_needs(config: RgspipeConfig) -> list[Need | str]:
    """What has the targets: one artifact for each of `relight.counts`, or that of the fit's own targets.

    Raises:
        InputError: a folder's lights are not known here.
    """
    if config.fit.target is not None:
        raise InputError(
            "fit.target",
            expected="nothing, to relight the true rigs of targets",
            found=str(config.fit.target),
            remedy="Show its lights in its cameras: relight.lights=FILE with the same fit.target.",
        )
    if not config.relight.counts:
        return [*target_stage(config)]
    # Lights need not be told from each other here, so each may be as weak as it is drawn.
    weak: dict[str, object] = {"targets.weakest": 0.0}
    return [Need("generate_targets", {"targets.count": [count, count]} | weak) for count in config.relight.counts]


def _targets(context: StageContext) -> Iterator[tuple[Target, LightRig]]:
    """Targets with true rigs, by their number of lights; where several artifacts have them, names tell them apart."""
    limit, found = context.config.relight.limit, 0
    for artifact in _artifacts(context):
        folder, several = artifact.folder(), bool(context.config.relight.counts)
        groups: dict[int, list[tuple[Path, LightRig]]] = {}
        for path in target_folders(folder):
            truth = dataset_root(folder) / "truth" / f"{path.name}.json"
            rig = read_lights(truth) if truth.exists() else ()
            groups.setdefault(len(rig), []).append((path, rig))
        groups.pop(0, None)
        for count, members in sorted(groups.items()):
            for index in spread_frames(len(members), limit or len(members)):
                path, rig = members[index]
                target, found = load_target(path), found + 1
                yield (replace(target, name=f"{count}_lights_{target.name}") if several else target), rig
    if not found:
        raise InputError(
            "relight.rigs",
            expected="targets whose true lights are known: truth/<target>.json",
            found="none",
            remedy="Give a light file: relight.lights=FILE.",
        )


def _artifacts(context: StageContext) -> list[Artifact]:
    if context.config.relight.counts:
        return list(context.input_lists["generate_targets"])
    [stage] = target_stage(context.config)
    return [context.inputs[stage]]
