"""`python -m rgspipe stage=view`: the configured scene in the browser, with its photographs and fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rgspipe.cli.compose import compose_config
from rgspipe.cli.jobs import run_jobs
from rgspipe.cli.view import serve
from rgspipe.cli.view_references import references
from rgspipe.config import RgspipeConfig
from rgspipe.errors import InputError
from rgspipe.graph.resolver import StageLoader, resolve
from rgspipe.store.artifacts import Artifact, ArtifactStore

if TYPE_CHECKING:
    from rgspipe.datasets.views import Target
    from rgspipe.scene import LightRig
    from rgspipe.viewer.material import Case, Found

#: How the command is written.
STAGE = "stage=view"


def view_stage(overrides: Sequence[str], stage_loader: StageLoader) -> int:
    """Make the frozen scene if it is not there, and serve its page until the process is interrupted.

    It is no stage of the graph: it makes nothing. Fits are shown that were made with the same settings.

    Raises:
        InputError: an override cannot be used.
    """
    if any(text in ("-m", "--multirun") for text in overrides):
        remedy = "Leave -m away: one page shows one scene."
        raise InputError(STAGE, expected="a single run", found="a sweep", remedy=remedy)
    rest = [text for text in overrides if text != STAGE]
    made = _Made(rest, stage_loader)
    if code := run_jobs([*rest, "stage=freeze"], stage_loader, multirun=False, leads_on=False):
        return code
    return _serve(made)


class _Made:
    """What the stages have made for one configuration."""

    def __init__(self, overrides: Sequence[str], stage_loader: StageLoader) -> None:
        self._overrides, self._load = list(overrides), stage_loader

    def config(self, stage: str) -> RgspipeConfig:
        """The configuration of a stage."""
        return compose_config([*self._overrides, f"stage={stage}"])

    def find(self, stage: str) -> Artifact | None:
        """The artifact of a stage; None where it is not made, or the scene has no such stage."""
        config = self.config(stage)
        try:
            return ArtifactStore(Path(config.outputs)).find(resolve(config, self._load).key)
        except InputError:  # A scene without images has no targets to be fitted.
            return None


def _serve(made: _Made) -> int:
    from rgspipe.cli.view_capture import captured
    from rgspipe.datasets.info import INFO
    from rgspipe.renderer.device import chosen_device
    from rgspipe.renderer.frozen import FrozenScene
    from rgspipe.stages.scene.export import NO_WATTS, world_of
    from rgspipe.viewer.serve import view

    config, freeze = made.config("freeze"), made.find("freeze")
    assert freeze is not None
    dataset = made.find("generate_dataset")
    world = world_of(config.export.metres, None if dataset is None else dataset.folder() / INFO)
    page = config.viewer
    viewer = view(
        FrozenScene.load(freeze.folder()).to(chosen_device(config.device)),
        cases=[*_cases(made, config), *captured(made.find, config), *_tracks(made)],
        references=references(None if dataset is None else dataset.folder()),
        port=page.port,
        resolution=page.resolution,
        address=page.address,
        world=world,
        notes=[NO_WATTS] if config.scene.lamps == "unknown" else [],
        exposure_free=config.fit.exposure == "free",
        base_scale_free=config.fit.base_scale == "free",
        ambient=config.light.ambient,
        emitters="auto" if config.fit.emitters == "auto" else None,
    )
    return serve(viewer, page.port, page.browser)


def _cases(made: _Made, config: RgspipeConfig) -> list:
    """The targets that fits of this configuration are of, each with its truth and fit where there are any."""
    from rgspipe.datasets.gs3 import load_target
    from rgspipe.datasets.light_file import read_lights
    from rgspipe.datasets.location import open_dataset
    from rgspipe.stages.sources import target_stage
    from rgspipe.stages.targets.true_lights import truth_file
    from rgspipe.viewer.material import found_in

    source = next((made.find(stage) for stage in target_stage(config)), None)
    if config.fit.target is not None:
        targets = [load_target(config.fit.target, config.fit.base)]
    elif source is None:
        return []
    else:
        targets = open_dataset(source.folder(), train=False, test=False).targets
    fits, cases = made.find("fit_light"), []
    for target in targets:
        truth = truth_file(config, source, target.name)
        folder = None if fits is None else fits.path / target.name
        found = found_in(folder) if folder is not None and folder.is_dir() else None
        cases.append(_case(target, config, () if truth is None else read_lights(truth), found))
    return cases


def _tracks(made: _Made) -> list:
    """The track of this configuration, if it is made."""
    from rgspipe.viewer.material import Case
    from rgspipe.viewer.tracks import FRAMES, track_in

    track = made.find("track")
    return [] if track is None else [Case("track", found=track_in(track.path / FRAMES))]


def _case(target: Target, config: RgspipeConfig, truth: LightRig, found: Found | None) -> Case:
    """A target as a fit of this configuration takes it; without photographs to search, and why, where none can.

    What the fit does not look at can still be looked at.
    """
    from rgspipe.stages.lights.capture import captured_views
    from rgspipe.stages.lights.targets import used_indices
    from rgspipe.viewer.material import Case, Photograph

    every = [Photograph.of(view, f"{target.name}, view {index}") for index, view in enumerate(target.views)]
    try:
        used = used_indices(target.name, len(target.views), config)
        views, capture = captured_views([target.views[index] for index in used], target.name, config)
    except InputError as error:
        return Case(target.name, (), truth, found, f"Lamps cannot be looked for here. {error}", every)
    case = Case.of(replace(target, views=tuple(views)), truth, found, capture)
    # None where only some of them are known with the lamps off.
    taken = [replace(one, name=every[index].name) for one, index in zip(case.photographs, used, strict=False)]
    others = [one for one in every if one.name not in {own.name for own in taken}]
    return replace(case, photographs=taken, others=others)
