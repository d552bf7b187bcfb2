"""Judge a frozen scene by held-out views, and say where its error sits."""

from __future__ import annotations

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.location import open_dataset
from rgspipe.evaluation.held_out import MEASURES, QUALITY, held_out_picture
from rgspipe.evaluation.images import save_png
from rgspipe.evaluation.judgement import kinds_of_views, render_views
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.stages.base import Need, Stage, StageContext
from rgspipe.stages.sources import has_truth, require_images
from rgspipe.store.files import write_text

#: What is said where there is nothing to judge by.
NOTHING = "judge: no view was left out of training (transforms_test.json), so there is nothing to compare renders with"

#: The columns of split.csv.
SPLIT = ["surfels", "light", "kind", "pixels", "error", "psnr"]


def run(context: StageContext) -> None:
    """Write quality.csv, split.csv, views.csv, comparison.png, typical.png; empty tables without views."""
    require_images(context.config, "held-out views")
    views = open_dataset(context.inputs["generate_dataset"].folder(), train=False, targets=False).test
    if not views:
        print(NOTHING)
        columns = (["surfels", "light", *QUALITY], SPLIT, ["name", *MEASURES])
        _write_tables(context, *(pd.DataFrame(columns=list(names)) for names in columns))
        return
    scenes = [FrozenScene.load(artifact.folder()) for artifact in context.input_lists["freeze"]]
    renders, surfels = render_views(scenes[0], views), context.config.freeze.surfels
    # Edges of shadows are told by the true surfels, so that scenes are split alike.
    kinds = kinds_of_views(scenes[1], views) if len(scenes) > 1 else None

    quality = renders.quality()
    quality.insert(0, "surfels", surfels)
    split = pd.DataFrame(columns=SPLIT) if kinds is None else renders.split(kinds).assign(surfels=surfels)[SPLIT]
    table = renders.table("pixels")
    _write_tables(context, quality, split, table)
    picture = held_out_picture(views, renders.images["pixels"], table["psnr"], renders.albedo)
    save_png(context.folder / "comparison.png", picture)
    save_png(context.folder / "typical.png", renders.typical("pixels"))
    context.note(psnr=dict(zip(quality["light"], quality["psnr"].round(2), strict=True)))


def _write_tables(context: StageContext, *tables: pd.DataFrame) -> None:
    for name, table in zip(("quality", "split", "views"), tables, strict=True):
        write_text(context.folder / f"{name}.csv", table.to_csv(index=False))


def _inputs(config: RgspipeConfig) -> list[Need | str]:
    truth = [Need("freeze", {"freeze.surfels": "truth"})] if has_truth(config) else []
    return ["freeze", *truth, "generate_dataset"]


STAGE = Stage(
    name="judge",
    help="held-out views of the frozen scene: PSNR, SSIM, FLIP, albedo, where the error sits",
    run=run,
    inputs=_inputs,
    config_keys=("freeze.surfels",),
)
