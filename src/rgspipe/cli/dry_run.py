"""`python -m rgspipe … --dry-run`: what a run would make and what it would reuse; nothing is made or written."""

from __future__ import annotations

from collections.abc import Sequence

from rgspipe.cli.compose import check_stage, compose_config
from rgspipe.cli.view_stage import STAGE
from rgspipe.errors import InputError
from rgspipe.graph.pipeline import told_plan
from rgspipe.graph.resolver import StageLoader
from rgspipe.stages import load_stage


def dry_run(arguments: Sequence[str], stage_loader: StageLoader) -> int:
    """Print the plan of a single run; the exit status.

    Raises:
        InputError: an override cannot be used, or there would be more than one run.
    """
    for text in arguments:
        if text in ("-m", "--multirun") or text.startswith("pipeline="):
            remedy = "Say one stage, and one value for each key."
            raise InputError("--dry-run", expected="a single run", found=text, remedy=remedy)
    # The page makes nothing but the scene that it shows, and hears other settings, too.
    page = STAGE in arguments
    config = compose_config(["stage=freeze" if text == STAGE else text for text in arguments])
    if stage_loader is load_stage:
        check_stage(config.stage)
    print(told_plan(config, stage_loader, () if page else arguments))
    return 0
