"""Render a pool of single lights in the scene, one at a time: fit targets are sums of them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from rgspipe.blender.fixed_view import FixedView
from rgspipe.blender.pool.job import PoolJob, SpotRange
from rgspipe.blender.pool.lamps import LampRange
from rgspipe.blender.pool.pool_file import read_pool
from rgspipe.blender.pool.render_pool import render_pool
from rgspipe.config import RgspipeConfig
from rgspipe.config.scene import MODELLED
from rgspipe.config.targets import TargetsConfig, TargetSpotConfig
from rgspipe.datasets.photometric_file import read_catalogue, read_photometry
from rgspipe.errors import InputError
from rgspipe.scene import SpotLight
from rgspipe.scene.lights.spot_profiles import PROFILES
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.images.generate_dataset import STAGE as DATASET
from rgspipe.stages.images.generate_dataset import dataset_job
from rgspipe.stages.sources import has_truth

#: Of a camera: where it stands, what it looks at, degrees across.
CAMERA_NUMBERS = 7

#: What does without Blender.
OTHERWISE = "The dataset's own targets need none: fit.targets=dataset."

#: Kinds of targets with spots.
SPOTS = ("spots", "mixed", "drive")


def run(context: StageContext) -> None:
    """Leave the pool's files and images; a repeated run goes on where an interrupted one ended."""
    render_pool(pool_job(context.config), context.folder, context.config.blender, OTHERWISE)
    context.note(kind=context.config.targets.kind, lights=len(read_pool(context.folder)))


def pool_job(config: RgspipeConfig) -> PoolJob:
    """What the configuration asks Blender for.

    Raises:
        InputError: spots or cameras make no sense, or what `check_scene` and `dataset_job` refuse.
    """
    wanted = config.targets
    check_scene(config)
    dataset = dataset_job(config)
    samples = wanted.samples or dataset.samples
    return PoolJob(
        # Nothing of the dataset's own images, so that what they are like changes nothing here.
        replace(
            dataset,
            train_views=0,
            test_views=0,
            targets_per_class=0,
            resolution=wanted.resolution or dataset.resolution,
            samples=samples,
            test_samples=samples,
            max_bounces=dataset.max_bounces if wanted.max_bounces is None else wanted.max_bounces,
            seed=wanted.pool_seed,
        ),
        wanted.kind,
        wanted.frames if wanted.kind == "drive" else wanted.pool,
        wanted.classes,
        spot_range(wanted.spot) if wanted.kind in SPOTS else SpotRange(),
        wanted.views,
        fixed_views(wanted),
        LampRange(wanted.radius, wanted.side, wanted.mounted, wanted.exponent, luminaires(wanted)),
    )


def check_scene(config: RgspipeConfig) -> None:
    """Refuse scenes that Blender does not render, a drive without a bend, and a pool of two types in one.

    Raises:
        InputError: says what would do.
    """
    kind, wanted = config.scene.kind, config.targets
    if not has_truth(config):
        raise InputError(
            "scene",
            expected=f"one that Blender renders ({', '.join(MODELLED)} or blend), to generate targets of",
            found=f"scene={kind}",
            remedy="Fit its own targets (fit.targets=dataset), or a folder of yours (fit.target=DIR).",
        )
    if wanted.kind == "drive" and kind != "corner":
        raise InputError(
            "targets.kind",
            expected="drive with scene=corner alone: the car drives around its bend",
            found=f"scene={kind}",
            remedy="Use scene=corner, or targets.kind=spots.",
        )
    if wanted.kind == "mixed" and config.stage == "render_olat":
        raise InputError(
            "targets.kind",
            expected="one type (points, spots …): mixed targets take one pool of points and one of spots",
            found="mixed",
            remedy="Use stage=generate_targets, which renders both.",
        )


def spot_range(spot: TargetSpotConfig) -> SpotRange:
    """The spots of the configuration in radians.

    Raises:
        InputError: a rim does not fit its cone.
    """
    profile, degree = PROFILES[spot.profile], math.radians(1.0)
    rim = degree if profile.falloff_unit else 1.0
    largest = profile.largest_falloff(degree * spot.cone_angle[0]) / rim
    widest = SpotLight.shaped(spot.profile, degree * spot.cone_angle[0], rim * spot.falloff[1])
    if spot.falloff[1] > largest * (1.0 + 1e-12) or widest.rim == 0.0:
        raise InputError(
            "targets.spot.falloff",
            expected=f"{'below' if widest.rim == 0.0 else 'at most'} {largest:g} for {spot.profile}",
            found=f"{spot.falloff[1]:g}",
            remedy="Give narrower rims.",
        )
    cones, rims = ((unit * ends[0], unit * ends[1]) for unit, ends in ((degree, spot.cone_angle), (rim, spot.falloff)))
    return SpotRange(spot.profile, cones, rims)


def fixed_views(targets: TargetsConfig) -> tuple[FixedView, ...]:
    """The cameras of the configuration; none where they are the scene's own.

    Raises:
        InputError: they are no cameras, or fewer than there are views.
    """
    numbers = targets.cameras or ()
    rows = [numbers[first : first + CAMERA_NUMBERS] for first in range(0, len(numbers), CAMERA_NUMBERS)]
    if len(numbers) % CAMERA_NUMBERS or (rows and len(rows) < targets.views):
        raise InputError(
            "targets.cameras",
            expected=f"{CAMERA_NUMBERS} numbers for each of targets.views={targets.views} cameras or more",
            found=f"{len(numbers)} numbers",
            remedy="Give place, point looked at and degrees of each, [x,y,z,x,y,z,degrees,…], or fewer views.",
        )
    for row in rows:
        if not 1.0 <= row[6] <= 170.0 or math.dist(row[:3], row[3:6]) == 0.0:
            raise InputError(
                "targets.cameras",
                expected="cameras that look at another place than they stand at, 1 to 170 degrees across",
                found=f"[{','.join(f'{number:g}' for number in row)}]",
                remedy="Correct these seven numbers.",
            )
    return tuple(FixedView(tuple(row[:3]), tuple(row[3:6]), row[6]) for row in rows)


def luminaires(targets: TargetsConfig) -> tuple[str, ...]:
    """The files of measured luminaires that profiles have; none of other kinds.

    Raises:
        InputError: none is named, or one cannot be read.
    """
    if targets.kind != "profiles":
        return ()
    if targets.luminaires is None:
        raise InputError(
            "targets.luminaires",
            expected="a measured luminaire's file, or a folder of them, with targets.kind=profiles",
            found="null",
            remedy="Name an IES (.ies) or EULUMDAT (.ldt) file.",
        )
    path = Path(targets.luminaires).resolve()
    if not path.is_dir():
        read_photometry(path)
        return (str(path),)
    return tuple(str(path / name) for name in read_catalogue(path))


def _files(config: RgspipeConfig) -> tuple[Path, ...]:
    return (*DATASET.files(config), *map(Path, luminaires(config.targets)))


def _inputs(config: RgspipeConfig) -> tuple[()]:
    check_scene(config)
    luminaires(config.targets)
    spot_range(config.targets.spot)
    fixed_views(config.targets)
    return ()


def _keys(config: RgspipeConfig) -> list[str]:
    scene = [key for key in DATASET.keys(config) if key.startswith("scene")]
    quality = [f"dataset.{name}" for name in ("resolution", "samples", "denoise", "max_bounces")]
    wanted = ["kind", "views", "resolution", "samples", "pool_seed"]
    wanted += ["frames"] if config.targets.kind == "drive" else ["pool", "classes"]
    wanted += ["spot"] if config.targets.kind in SPOTS else []
    wanted += {"spheres": ["radius"], "panels": ["side"], "leds": ["exponent"]}.get(config.targets.kind, [])
    # Named only where they are set: else they say nothing that the scene and the dataset's keys do not.
    wanted += [name for name in ("cameras", "max_bounces", "mounted") if getattr(config.targets, name) is not None]
    return [*scene, *quality, *(f"targets.{name}" for name in wanted)]


STAGE = Stage(
    name="render_olat",
    help="render single lights, one at a time, of which targets are made",
    run=run,
    inputs=_inputs,
    config_keys=_keys,
    files=_files,
)
