"""The typed schema of every configuration group: fields, defaults, units and ranges.

The files under conf/ extend these classes; a key that is not here is refused. `RgspipeConfig` is what a stage
sees; the library below the stages takes plain arguments and knows nothing of it.
"""

from __future__ import annotations

import dataclasses
import math
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

from rgspipe.errors import InputError

SCENE_KINDS = ("cornell", "corner", "hotdog", "room", "blend", "external", "ply")
MODELLED = SCENE_KINDS[:4]
OCCLUSIONS = ("visible", "out_of_frame", "occluded", "around_corner", "all")
PLY_FRONTS = ("auto", "kept", "inwards", "outwards", "cameras")
FIT_METHODS = ("search_lm", "paper_adam", "finite_differences")
ADAM_AIMS = ("center", "random")
TARGET_KINDS = ("points", "spots", "mixed", "track")
LIGHT_STUDIES = ("views", "robustness", "classes", "kinds", "regions", "adam")
ROOM_NAMES = ("cornell", "corridor", "clutter")


def option(
    default: Any,
    help: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: Sequence[str] | None = None,
    length: int | None = None,
) -> Any:
    """A documented field: `low` ≤ value ≤ `high`, one of `choices`, or a list of `length` values in the range."""
    metadata = {"help": help, "low": low, "high": high, "choices": choices, "length": length}
    if isinstance(default, list):
        return field(default_factory=lambda: list(default), metadata=metadata)
    return field(default=default, metadata=metadata)


def section(schema: type, help: str) -> Any:
    """A documented group of fields."""
    return field(default_factory=schema, metadata={"help": help})


def _color(red: float, green: float, blue: float, what: str) -> Any:
    return option([red, green, blue], f"{what}, RGB reflectance", low=0.0, high=1.0, length=3)


@dataclass
class CornellConfig:
    """A room with two boxes, inside the unit cube: x to the right, y away from the open front, z up, floor at z = 0."""

    room: list[float] = option([1.0, 1.0, 1.0], "inner width, depth and height, scene units", low=0.1, high=1, length=3)
    wall_color: list[float] = _color(0.73, 0.73, 0.73, "floor, ceiling and back wall")
    left_color: list[float] = _color(0.65, 0.05, 0.05, "left wall")
    right_color: list[float] = _color(0.12, 0.45, 0.15, "right wall")
    box_color: list[float] = _color(0.73, 0.73, 0.73, "both boxes")
    tall_size: list[float] = option([0.28, 0.28, 0.6], "tall box: width, depth, height", low=0.01, high=1, length=3)
    tall_center: list[float] = option([0.33, 0.62], "tall box: centre of its foot, x and y", low=0, high=1, length=2)
    tall_angle: float = option(17.2, "tall box: turn about the vertical, degrees", low=-180, high=180)
    short_size: list[float] = option([0.28, 0.28, 0.3], "short box: width, depth, height", low=0.01, high=1, length=3)
    short_center: list[float] = option([0.68, 0.35], "short box: centre of its foot, x and y", low=0, high=1, length=2)
    short_angle: float = option(-17.2, "short box: turn about the vertical, degrees", low=-180, high=180)
    gloss: float = option(0.0, "specular reflectance k_s of both boxes: a Phong lobe on their colour", low=0, high=1)
    shininess: float = option(20.0, "exponent n of that lobe", low=1, high=1000)


@dataclass
class CornerConfig:
    """A closed corridor around a corner: two legs, each 1 scene unit long outside."""

    width: float = option(0.32, "width of the corridor, scene units", low=0.28, high=0.36)
    height: float = option(0.45, "height of the corridor, scene units", low=0.35, high=1)
    wall_color: list[float] = _color(0.75, 0.75, 0.72, "walls and ceiling")
    floor_color: list[float] = _color(0.55, 0.5, 0.42, "floor")
    near_end_color: list[float] = _color(0.2, 0.35, 0.65, "wall at the end of the leg that the targets show")
    far_end_color: list[float] = _color(0.7, 0.4, 0.15, "wall at the end of the other leg")


@dataclass
class HotdogConfig:
    """A hot dog on a plate, in empty space."""

    textured: bool = option(True, "textures on bun and sausage; without them every part has one colour")
    segments: int = option(192, "faces around plate and bun", low=48, high=2000)


@dataclass
class RoomConfig:
    """A closed room with a table, a bookcase, an armchair and ten other things."""

    textured: bool = option(True, "textures on floor, walls and furniture; without them every part has one colour")
    segments: int = option(192, "faces around whatever is round", low=48, high=2000)


@dataclass
class PlyConfig:
    """What a PLY file from elsewhere leaves open; files that `stage=export` wrote say all of it themselves."""

    fronts: str = option(
        "auto",
        "side of the surfels that light falls on: as the rotations say, towards the middle (rooms), away from it "
        "(objects), or towards the cameras of the images",
        choices=PLY_FRONTS,
    )
    cameras: str | None = option(None, "cameras.json of a 3DGS model, or a transforms file; by default the model's own")
    srgb: bool = option(True, "colours of Gaussians are display values, not linear ones")
    low: float | None = option(None, "raw coverage that counts as none; by default what suits the file", low=0, high=1)
    high: float | None = option(None, "raw coverage that is opaque; by default what suits the file", low=0, high=1)
    layer: float = option(1.0, "thickness of a layer in the median scale of the surfels", low=0.01, high=100)
    minimum_alpha: float = option(0.01, "opacity below which a surfel is not there", low=1e-4, high=0.5)
    gloss: bool = option(False, "take over the gloss of RadiosityGS; fits pass over it, and it takes memory")
    crop: list[float] | None = option(
        None, "box that is kept: lower and upper x, y, z in [x,y,z,x,y,z]", low=-1e6, high=1e6, length=6
    )
    max_surfels: int = option(100000, "files with more are refused: operators grow with them", low=2, high=100_000_000)


@dataclass
class SceneConfig:
    """What is looked at."""

    kind: str = option("cornell", "where the scene comes from", choices=SCENE_KINDS)
    name: str | None = option(None, "its name under outputs/; by default that of the file or folder")
    path: str | None = option(None, "blend, ply: the file; external: the dataset's folder")
    cornell: CornellConfig = section(CornellConfig, "the parametric box of scene=cornell")
    corner: CornerConfig = section(CornerConfig, "the corridor of scene=corner")
    hotdog: HotdogConfig = section(HotdogConfig, "the hot dog of scene=hotdog")
    room: RoomConfig = section(RoomConfig, "the furnished room of scene=room")
    ply: PlyConfig = section(PlyConfig, "what a file of scene=ply leaves open")


@dataclass
class DatasetConfig:
    """How the images are made (unused by scene=external)."""

    resolution: int = option(128, "image width and height, pixels", low=8, high=8192)
    train_views: int = option(100, "training views, each with one light of its own", low=1, high=100000)
    test_views: int = option(24, "held-out views: new cameras and new lights", low=1, high=100000)
    targets_per_class: int = option(20, "fit targets of each occlusion class", low=0, high=10000)
    target_views: int = option(3, "fixed cameras that see each fit target", low=1, high=3)
    samples: int = option(48, "paths per pixel of training views and targets", low=1, high=1000000)
    test_samples: int = option(
        192, "paths per pixel of held-out views: with 48 their noise hides 2 dB", low=1, high=1000000
    )
    denoise: bool = option(True, "denoise the colour images")
    max_bounces: int = option(12, "bounces of a path; fewer than 8 lose light", low=0, high=1024)
    seed: int = option(0, "draws of cameras and lights", low=0, high=2**31 - 1)


@dataclass
class CaptureConfig:
    """Errors of a real capture, put into the training views; held-out views and targets stay clean."""

    depth_noise: float = option(0.0, "depth: standard deviation in every pixel over the depth", low=0, high=1)
    depth_missing: float = option(0.0, "depth: share of unknown pixels, half of them in blobs", low=0, high=0.99)
    image_noise: float = option(
        0.0, "images: standard deviation over the value, and a tenth of it over the brightest value", low=0, high=10
    )
    light_position_noise: float = option(0.0, "lights: standard deviation of a coordinate, scene units", low=0, high=10)
    light_intensity_noise: float = option(0.0, "lights: standard deviation of the log-intensity", low=0, high=10)
    views: int | None = option(None, "keep so many views, spread evenly", low=1, high=100000)
    normals: bool = option(True, "keep the normal pass")
    albedo: bool = option(True, "keep the albedo pass")
    seed: int = option(0, "draws of the errors", low=0, high=2**31 - 1)


@dataclass
class InitConfig:
    """From depth maps to surfels."""

    surfels: int = option(10000, "how many surfels", low=100, high=10_000_000)
    detail: float | None = option(
        None, "… times this; by default 2 for hotdog and room, which have much of it, else 1", low=0.01, high=100
    )
    scale: float = option(0.6, "standard deviation of a surfel over the spacing of its neighbours", low=0.05, high=10)
    normals: str = option(
        "auto", "fitted to the depth, or the views' normal pass", choices=("auto", "estimate", "pass")
    )
    clips: bool = option(True, "straight edges for surfels at the border of a flat surface")
    seed: int = option(0, "draws of points", low=0, high=2**31 - 1)


@dataclass
class TrainConfig:
    """From images to material and refined geometry."""

    rounds: int = option(5, "rounds of the linear albedo solve, before and after the geometry", low=1, high=1000)
    steps: int = option(140, "gradient steps of the geometry", low=0, high=1000000)
    views_per_step: int = option(5, "images that a gradient step looks at", low=1, high=1000)
    edge_pixels: int = option(2000, "most pixels on edges, of each image of a step", low=1, high=10_000_000)
    interior_pixels: int = option(1000, "most pixels elsewhere, of each image of a step", low=0, high=10_000_000)
    subsamples: int = option(3, "rays per pixel of a step, squared", low=1, high=16)
    supersampling: int = option(4, "rays per edge pixel in view weights, squared", low=1, high=16)
    at_pixels: bool = option(True, "direct light where pixels look, otherwise at surfels' centres: softer shadows")
    unseen: bool = option(True, "close rooms where no camera saw what is there: backs of boxes, floors behind them")
    light_rounds: int = option(
        0, "how often each fit of materials refines the training lights; their mean stays", low=0, high=100
    )
    gather_rays: int = option(128, "hemisphere rays of a surfel while training", low=8, high=65536)
    patches: int = option(500, "patches of the indirect light while training", low=8, high=20000)
    albedo_prior: str = option(
        "none",
        "what is known of the albedo: nothing, or the albedo maps of the training views, from any method and up to a "
        "scale of each image",
        choices=("none", "dataset"),
    )
    albedo_prior_weight: float = option(
        0.3, "what the prior counts where its maps agree; the images count 1 in the median surfel", low=0, high=1e6
    )
    photometric_rounds: int = option(
        1, "how often shading turns the normals of surfels that depth left rough; 0 for never", low=0, high=100
    )
    relight_every: int = option(
        0,
        "gradient steps between which shadows and indirect light lag; 0 keeps those of the start",
        low=0,
        high=1000000,
    )
    growth: float = option(
        1.0, "most surfels after splits, which come with relight_every, over those before", low=1, high=100
    )
    loss: str = option("l2", "what gradient steps minimise; l1_ssim needs windows", choices=("l2", "l1", "l1_ssim"))
    ssim_weight: float = option(0.2, "λ, the share of SSIM in the loss l1_ssim", low=0, high=1)
    compression: float = option(
        0.0, "µ of the loss's compression log(1 + µx)/log(1 + µ) of radiance over its peak; 0 for none", low=0, high=1e6
    )
    window: int = option(
        0, "side of the windows of pixels that a step looks at; 0 for single pixels", low=0, high=100000
    )
    tilt_rate: float = option(0.0, "gradient step of normals, rad", low=0, high=1)
    height_rate: float = option(0.0, "gradient step along normals, in surfel spacings", low=0, high=1)
    continuity_weight: float = option(0.0, "weight of normals that agree with positions", low=0, high=1e6)
    smoothness_weight: float = option(0.0, "weight of neighbours' like normals", low=0, high=1e6)
    distortion_weight: float = option(0.0, "weight of the spread of hits within a layer", low=0, high=1e6)
    alpha_weight: float = option(
        0.05, "weight of the difference between coverage and the images' alpha", low=0, high=1e6
    )
    checkpoint_every: int = option(20, "gradient steps between checkpoints", low=1, high=1000000)
    direct_only: bool = option(True, "also fit and report a model without interreflection, for comparison")
    seed: int = option(0, "draws of pixels and rays", low=0, high=2**31 - 1)
    memory_mib: float = option(
        4096.0,
        "memory [MiB] for the training views' operators; those beyond it are read from a file, with the same results",
        low=0,
        high=1e9,
    )
    gloss: str = option(
        "none",
        "none: every surface is diffuse; auto: surfels get a Phong lobe where it explains images it was not fitted to",
        choices=("none", "auto"),
    )


@dataclass
class ExportConfig:
    """Surfels for other programs."""

    light: str | None = option(None, "light file: colours show the scene under these lights; by default the albedo")
    layout: str = option(
        "full",
        "all of a surfel, for this program and viewers that read properties by name; or just those of 3DGS, in order",
        choices=("full", "viewer"),
    )


@dataclass
class FreezeConfig:
    """The light-independent operators of the trained scene."""

    surfels: str = option(
        "trained",
        "what is frozen: the trained surfels, or some made from the true surfaces, to compare with",
        choices=("trained", "truth"),
    )
    gather_rays: int = option(256, "hemisphere rays of a surfel", low=8, high=65536)
    patches: int = option(1000, "patches of the indirect light", low=8, high=20000)
    dictionary_grid: int = option(8, "candidate lights along each axis of the room", low=2, high=64)
    seed: int = option(0, "draws of rays", low=0, high=2**31 - 1)


@dataclass
class ModelErrorConfig:
    """Errors put into the scene that is frozen, to measure what they cost a fit."""

    albedo: float = option(
        0.0, "albedo: standard deviation of the log-error, smooth over 0.15 of the scene", low=0, high=2
    )
    albedo_factor: float = option(1.0, "albedo: factor on all of it", low=0.01, high=100)
    position: float = option(
        0.0, "surfels: standard deviation of a shift along the normal, parts of the scene's size", low=0, high=0.5
    )
    tilt: float = option(0.0, "normals: standard deviation of a turn about each of two axes, degrees", low=0, high=60)
    missing: list[float] | None = option(
        None, "a missing object: box [x,y,z,x,y,z] without surfels, scene units", low=-1e6, high=1e6, length=6
    )
    seed: int = option(0, "draws of the errors", low=0, high=2**31 - 1)


@dataclass
class TargetCaptureConfig:
    """Errors of a real camera, put into the images of fit targets."""

    noise: float = option(
        0.0, "standard deviation over the value, and a tenth of it over the brightest value", low=0, high=10
    )
    exposure: float = option(
        0.0, "standard deviation of the exposure of every view but the first, in stops", low=0, high=10
    )
    white: float | None = option(
        None, "8-bit images that clip what is above this quantile of the target's values", low=0.01, high=1
    )
    seed: int = option(0, "draws of the errors", low=0, high=2**31 - 1)


@dataclass
class ViewsConfig:
    """How much of a fit target is seen."""

    count: int = option(1, "the first `count` cameras of the target", low=1, high=1000)
    indices: list[int] | None = option(None, "these cameras instead of the first ones", low=0, high=100000)


@dataclass
class SpotConfig:
    """The profile of unknown spots; with fit.cone=free its kind, and a rim to begin with."""

    profile: str = option(
        "smoothstep",
        "how intensity falls with the angle from the axis: Blender's smoothstep, gaussian, or Mitsuba's linear",
        choices=("smoothstep", "gaussian", "linear"),
    )
    cone_angle: float = option(25.0, "half-angle of the cone, degrees", low=1, high=89)
    falloff: float = option(
        0.15,
        "width of the rim: of smoothstep Blender's blend (0 to 1); of gaussian the standard deviation, of linear the "
        "half-angle of the inner cone, degrees",
        low=0,
        high=89,
    )


@dataclass
class LightConfig:
    """What is looked for."""

    type: str = option("point", "type of the unknown lights", choices=("point", "spot", "auto"))
    count: int | None = option(1, "how many unknown lights; null finds out", low=1, high=8)
    spot: SpotConfig = section(SpotConfig, "the profile of unknown spots")


@dataclass
class SearchConfig:
    """Dictionary search with closed-form intensity, then Levenberg-Marquardt."""

    starts: int = option(4, "best candidates that are refined", low=1, high=4096)
    iterations: int = option(30, "Levenberg-Marquardt steps of one start", low=1, high=10000)
    mask_edges: bool = option(True, "leave out pixels at depth and normal edges")


@dataclass
class AdamConfig:
    """The paper's method, with its defaults."""

    epochs: int = option(25, "epochs", low=1, high=100000)
    steps: int = option(50, "steps of an epoch", low=1, high=100000)
    position_rate: float = option(0.01, "learning rate of the position", low=0, high=10)
    intensity_rate: float = option(0.05, "learning rate of the log-intensity", low=0, high=10)
    ssim_weight: float = option(0.2, "λ, the share of SSIM in the loss", low=0, high=1)
    init: str = option("dataset", "where starts are drawn from", choices=("dataset", "sphere"))
    random_intensity: bool = option(False, "draw the first intensity too")
    seed: int = option(0, "draws of starts", low=0, high=2**31 - 1)
    axis_rate: float = option(0.005, "learning rate of spots' axes", low=0, high=10)
    aim: str = option("center", "where spots point at first: to the scene's middle, or anywhere", choices=ADAM_AIMS)


@dataclass
class FitConfig:
    """From images of the frozen scene to lights."""

    method: str = option("search_lm", "how", choices=FIT_METHODS)
    target: str | None = option(None, "a target's folder; by default the dataset's own targets")
    truth: str | None = option(None, "light file with the true lights of `target`, for evaluate only")
    limit: int | None = option(None, "at most this many targets of each class", low=1, high=100000)
    search: SearchConfig = section(SearchConfig, "fit=search_lm")
    adam: AdamConfig = section(AdamConfig, "fit=paper_adam")
    cone: str = option(
        "known", "whether spots' cones are those of light.spot, or recovered, too", choices=("known", "free")
    )
    suggest_view: bool = option(False, "say which further camera would help most, and how many views are needed")
    wanted_accuracy: float = option(
        0.003, "with suggest_view: position error to reach, fraction of the scene's size", low=0, high=1
    )
    landscape: bool = option(
        False, "work out the loss on three planes through the first light, for evaluate to draw; half a minute a target"
    )
    exposure: str = option(
        "known",
        "whether the images hold radiance, or every view but the first has an unknown factor, too",
        choices=("known", "free"),
    )
    clip: float | None = option(
        None, "radiance at which images are clipped; by default 1 for 8-bit sRGB, else none", low=1e-12, high=1e12
    )
    targets: str = option(
        "dataset",
        "whose targets: the dataset's, or those that stage=generate_targets makes as targets.* says",
        choices=("dataset", "generated"),
    )
    spot_basis: str = option(
        "exact",
        "how a fit's model has spots: by their profile, or as the paper in spherical harmonics",
        choices=("exact", "sh"),
    )
    sh_degree: int = option(8, "with spot_basis=sh: the highest degree", low=0, high=64)
    sh_mirrored: bool = option(True, "with spot_basis=sh: light goes backwards as it does forwards, as in the paper")


@dataclass
class EffectsConfig:
    """Which parts of light transport are computed."""

    shadows: bool = option(True, "surfels block light")
    interreflection: bool = option(True, "light bounces between surfels")
    at_pixels: bool = option(
        True, "direct light where pixels look, in a fit's last steps: sharper than at surfels' centres, and dearer"
    )
    solver: str = option(
        "patches",
        "how light bounces: averaged over patches, through the full gather operator, or by the paper's random rays",
        choices=("patches", "gather", "monte_carlo"),
    )
    bounces: int | None = option(None, "how many; by default all, and 4 for monte_carlo", low=0, high=1000)
    samples: int = option(64, "random rays of a surfel and bounce, for monte_carlo", low=1, high=65536)
    auto: bool = option(True, "leave out, of these, what cannot change an image by more than `tolerance`")
    tolerance: float = option(
        0.001, "with auto: largest change, fraction of the brightest direct radiance", low=0, high=1
    )


@dataclass
class AccuracyConfig:
    """Which preset of the accuracy group is in force; the preset sets keys of the other groups."""

    name: str = option("standard", "preset", choices=("draft", "standard", "reference"))


@dataclass
class EvaluateConfig:
    """How estimates are judged."""

    success: float = option(0.01, "largest position error of a success, fraction of the scene's size", low=0, high=1)
    bootstrap: int = option(2000, "resamples behind the interval of the median", low=0, high=1000000)


@dataclass
class StudyConfig:
    """What becomes of a trained scene when its capture gets worse."""

    cases: list[str] = option(
        ["clean"],
        "captures: `clean`, keys of capture.* such as depth_noise=0.01, or any others such as train.steps=0; several "
        "joined by spaces, and `NAME: ` before them where wanted",
    )
    scenes: list[str] = option([], "scenes that are compared; by default the one that is configured", choices=MODELLED)
    limit: int | None = option(6, "lights of each class that are recovered in each case", low=1, high=100000)


@dataclass
class ReportConfig:
    """What the report compares."""

    truth: bool = option(True, "also recover the lights with surfels made from the true surfaces, where they are known")
    views: list[int] = option([1, 3], "numbers of views", low=1, high=1000)
    methods: list[str] = option(["search_lm", "paper_adam"], "methods", choices=FIT_METHODS)
    paper_adam_limit: int | None = option(1, "targets of each class that paper_adam is run on", low=1, high=100000)


@dataclass
class OverviewConfig:
    """The page over scenes."""

    scenes: list[str] = option(
        ["cornell", "corner", "hotdog", "room", "cornell_glossy"],
        "scenes by the names of their folders, in this order; the newest report of each is taken",
    )


@dataclass
class BenchmarkConfig:
    """What is measured."""

    kind: str = option(
        "renderer",
        "the renderer on rooms with path-traced truth, or the steps of a fit on the trained scene",
        choices=("renderer", "fit"),
    )
    repetitions: int = option(20, "runs of each measured step", low=1, high=100000)
    rooms: list[str] = option(list(ROOM_NAMES), "rooms that are path-traced and measured on", choices=ROOM_NAMES)
    truth_resolution: int = option(128, "width and height of the path-traced images, pixels", low=8, high=8192)
    truth_samples: int = option(
        1024, "paths per pixel of the path-traced images with all bounces; a multiple of 8", low=8, high=1000000
    )


@dataclass
class TargetSpotConfig:
    """The spots of generated targets; each range is drawn from uniformly."""

    profile: str = option(
        "smoothstep", "how intensity falls with the angle from the axis", choices=("smoothstep", "gaussian", "linear")
    )
    cone_angle: list[float] = option(
        [25.0, 25.0], "least and largest half-angle of the cone, degrees", low=1, high=89, length=2
    )
    falloff: list[float] = option(
        [0.15, 0.15], "least and largest width of the rim, as light.spot.falloff", low=0.001, high=89, length=2
    )


@dataclass
class TargetsConfig:
    """Generated fit targets: sums of single lights, each of which is rendered once."""

    kind: str = option(
        "points",
        "lights of a target: points, spots, of each at least one, or the headlights of a car that drives around the "
        "bend of scene=corner",
        choices=TARGET_KINDS,
    )
    number: int = option(40, "targets; a track has `frames`", low=1, high=100000)
    count: list[int] = option([1, 1], "fewest and most lights of a target", low=1, high=8, length=2)
    classes: list[str] = option(
        list(OCCLUSIONS[:-1]),
        "where lights are, in turn; classes that the scene has none of are left out",
        choices=OCCLUSIONS[:-1],
    )
    weakest: float = option(0.15, "least share of a light in the mean radiance of its target", low=0, high=0.5)
    separation: float = option(0.1, "least distance between the lights of a target, scene units", low=0, high=10)
    seed: int = option(0, "draws of which lights make up a target, and of their intensities", low=0, high=2**31 - 1)
    pool: int = option(60, "lights of each type that are rendered, one at a time", low=1, high=100000)
    pool_seed: int = option(0, "draws of the lights' places, axes and cones", low=0, high=2**31 - 1)
    frames: int = option(24, "targets of a track, equally far apart on the way", low=1, high=100000)
    views: int = option(3, "fixed cameras that see each target", low=1, high=8)
    cameras: list[float] | None = option(
        None,
        "cameras in the place of the scene's own: of each the place and a point that it looks at, scene units, and "
        "degrees across, [x,y,z,x,y,z,degrees,…]",
        low=-1e6,
        high=1e6,
    )
    resolution: int | None = option(None, "image width and height, pixels; by default the dataset's", low=8, high=8192)
    samples: int | None = option(None, "paths per pixel of a single light; by default the dataset's", low=1, high=10**6)
    max_bounces: int | None = option(
        None,
        "bounces of a path; by default the dataset's. Around a corner 12 lose 2 to 4 %",
        low=0,
        high=1024,
    )
    spot: TargetSpotConfig = section(TargetSpotConfig, "what spots are like")


@dataclass
class TrackConfig:
    """Lights that move from frame to frame."""

    folder: str | None = option(
        None, "a folder whose targets/ are the frames, in order; by default those of generate_targets, kind=track"
    )
    lost: float = option(
        2.0, "a frame that is so many times worse explained than those next to it is searched anew", low=1, high=1000
    )
    iterations: int = option(15, "most Levenberg-Marquardt steps of a frame", low=1, high=10000)
    searches: int = option(6, "most frames that are searched from nothing", low=1, high=10000)
    together: bool = option(False, "the lights are carried by one thing, such as a car: they move and turn together")


@dataclass
class SweepConfig:
    """The spot of relight.sweep and its way."""

    frames: int = option(48, "images of the way", low=2, high=10000)
    seconds: float = option(4.0, "how long the video shows them, s", low=0.1, high=1000)
    position: list[float] | None = option(
        None,
        "aim: place of the spot, scene units; by default under the middle of a ceiling, or above an object",
        low=-1e6,
        high=1e6,
        length=3,
    )
    aims: list[float] | None = option(
        None,
        "aim: points that the axis turns from and to, [x,y,z,x,y,z]; by default low at either side of the picture",
        low=-1e6,
        high=1e6,
        length=6,
    )
    center: list[float] | None = option(
        None, "orbit: what the spot is aimed at; by default the scene's middle", low=-1e6, high=1e6, length=3
    )
    radius: float | None = option(None, "orbit: radius of the circle, scene units", low=1e-6, high=1e6)
    height: float | None = option(None, "orbit: height of the circle over `center`, scene units", low=-1e6, high=1e6)
    intensity: list[float] = option([1.0, 1.0, 1.0], "of the spot on its axis, RGB, W/sr", low=0, high=1e9, length=3)
    spot: SpotConfig = section(SpotConfig, "the profile of the spot")


@dataclass
class RelightConfig:
    """A frozen scene in any lights."""

    lights: str | None = option(None, "light file: points, spots or both; by default what `rigs` says")
    rigs: str = option(
        "random",
        "lights where no file is given: drawn at random, or the true ones of fit targets, compared with their images",
        choices=("random", "targets"),
    )
    count: int = option(3, "lights of a random rig", low=1, high=8)
    seed: int = option(0, "draws of a random rig", low=0, high=2**31 - 1)
    counts: list[int] = option(
        [], "numbers of lights: generated targets of each are compared side by side", low=1, high=8
    )
    limit: int | None = option(8, "most targets of each number of lights", low=1, high=100000)
    views: str = option(
        "targets",
        "whose cameras: those of the fit targets, the held-out or the training views",
        choices=("targets", "test", "train"),
    )
    indices: list[int] | None = option(
        None, "these of the cameras; by default all, for a sweep the first", low=0, high=100000
    )
    resolution: int | None = option(
        None, "width of the images, pixels; by default that of the cameras' own; not beside truth", low=8, high=8192
    )
    sweep: str = option(
        "none",
        "a spot that turns at its place, or goes around the scene, as a strip and a video",
        choices=("none", "aim", "orbit"),
    )
    path: SweepConfig = section(SweepConfig, "the spot of a sweep and its way")


@dataclass
class LightStudyConfig:
    """What recovered lights are like over numbers of views, bad images and models, or where the lights are."""

    kind: str = option(
        "robustness",
        "the figure: errors against the number of views; cases of errors in images and model; classes of lights; "
        "kinds of lights; how often 95 % regions hold the truth; or the paper's method beside ours",
        choices=LIGHT_STUDIES,
    )
    cases: list[str] = option(
        ["clean"],
        "what is compared: `clean`, or keys such as target_capture.noise=0.03, several joined by spaces, and `NAME: ` "
        "before them where wanted",
    )
    scenes: list[str] = option([], "scenes that are compared; by default the one that is configured", choices=MODELLED)
    views: list[int] = option([1], "numbers of views", low=1, high=1000)
    methods: list[str] = option(["search_lm"], "methods", choices=FIT_METHODS)
    paper_adam_limit: int | None = option(1, "targets of each class that paper_adam is run on", low=1, high=100000)
    paper_adam_views: list[int] | None = option(
        None, "numbers of views that paper_adam, which takes minutes a target, is run on; all if null", low=1, high=1000
    )


@dataclass
class ConvergenceConfig:
    """How methods get from their start to their answer."""

    methods: list[str] = option(list(FIT_METHODS), "methods that are compared", choices=FIT_METHODS)
    limit: int = option(1, "targets of each class, where fit.limit does not say", low=1, high=100000)


@dataclass
class DebugConfig:
    """What is shown when something goes wrong."""

    traceback: bool = option(False, "show the traceback of an error on the terminal as well")


@dataclass
class RgspipeConfig:
    """Everything that can be configured."""

    stage: str = option("???", "what to run")
    upstream: str = option("build", "what to do about missing inputs", choices=("build", "require"))
    outputs: str = option("outputs", "folder of artifacts and reports, relative to the current one")
    seed: int = option(0, "seed of the fit's own draws", low=0, high=2**31 - 1)
    occlusion: str = option("all", "class of fit targets", choices=OCCLUSIONS)
    scene: SceneConfig = section(SceneConfig, "what is looked at")
    dataset: DatasetConfig = section(DatasetConfig, "how images are made")
    capture: CaptureConfig = section(CaptureConfig, "errors put into the training views")
    init: InitConfig = section(InitConfig, "from depth to surfels")
    train: TrainConfig = section(TrainConfig, "from images to materials")
    freeze: FreezeConfig = section(FreezeConfig, "light-independent operators")
    export: ExportConfig = section(ExportConfig, "surfels for other programs")
    views: ViewsConfig = section(ViewsConfig, "how much of a target is seen")
    light: LightConfig = section(LightConfig, "what is looked for")
    fit: FitConfig = section(FitConfig, "from images to lights")
    effects: EffectsConfig = section(EffectsConfig, "parts of light transport")
    accuracy: AccuracyConfig = section(AccuracyConfig, "preset of accuracy against time")
    evaluate: EvaluateConfig = section(EvaluateConfig, "how estimates are judged")
    study: StudyConfig = section(StudyConfig, "what bad captures cost")
    report: ReportConfig = section(ReportConfig, "what the report compares")
    overview: OverviewConfig = section(OverviewConfig, "the page over scenes")
    benchmark: BenchmarkConfig = section(BenchmarkConfig, "what is timed")
    debug: DebugConfig = section(DebugConfig, "when something goes wrong")
    model_error: ModelErrorConfig = section(ModelErrorConfig, "errors put into the frozen scene")
    target_capture: TargetCaptureConfig = section(TargetCaptureConfig, "errors put into fit targets")
    track: TrackConfig = section(TrackConfig, "lights that move")
    targets: TargetsConfig = section(TargetsConfig, "generated fit targets")
    light_study: LightStudyConfig = section(LightStudyConfig, "what recovered lights are like")
    relight: RelightConfig = section(RelightConfig, "a frozen scene in any lights")
    convergence: ConvergenceConfig = section(ConvergenceConfig, "from start to answer")


def scene_name(config: RgspipeConfig) -> str:
    """The scene's folder under outputs/: `scene.name`, or else the stem of its file, folder or kind."""
    if config.scene.name is not None:
        return config.scene.name
    if config.scene.kind in MODELLED or config.scene.path is None:
        return config.scene.kind
    return Path(config.scene.path).resolve().stem


def get_value(config: object, key: str) -> Any:
    """The value at a dotted key, sections as plain dictionaries; ValueError if there is none."""
    value = config
    for part in key.split("."):
        if not is_dataclass(value) or part not in {item.name for item in fields(value)}:
            raise ValueError(f"no configuration key {key!r}")
        value = getattr(value, part)
    return dataclasses.asdict(value) if is_dataclass(value) else value


def with_changes(config: RgspipeConfig, changes: Mapping[str, object]) -> RgspipeConfig:
    """A copy with the values of dotted keys replaced; ValueError if a key does not exist."""
    for key, value in changes.items():
        config = _replaced(config, key.split("."), value, key)
    return config


def _replaced(node: Any, path: list[str], value: object, key: str) -> Any:
    if not is_dataclass(node) or path[0] not in {item.name for item in fields(node)}:
        raise ValueError(f"no configuration key {key!r}")
    inner = value if len(path) == 1 else _replaced(getattr(node, path[0]), path[1:], value, key)
    return dataclasses.replace(node, **{path[0]: inner})


def describe(schema: type, prefix: str = "") -> Iterator[tuple[str, str, Any]]:
    """(dotted key, help with the range, default) of every field of a schema and its sections, in order."""
    hints = typing.get_type_hints(schema)
    for item in fields(schema):
        key = f"{prefix}{item.name}"
        if is_dataclass(hints[item.name]):
            yield from describe(hints[item.name], f"{key}.")
        else:
            default = item.default if item.default is not dataclasses.MISSING else item.default_factory()
            yield key, f"{item.metadata['help']}{_range_text(item.metadata)}", default


def _range_text(rule: Mapping[str, Any]) -> str:
    if rule["choices"]:
        return f" ({' | '.join(rule['choices'])})"
    if rule["low"] is not None and rule["high"] is not None:
        return f" ({_short(rule['low'])} to {_short(rule['high'])})"
    return ""


def _short(number: float) -> str:
    return str(number) if isinstance(number, int) else f"{number:g}"


def check_values(config: RgspipeConfig) -> None:
    """Refuse values that are of the right type but make no sense.

    Raises:
        InputError: names the key, what it may be and what it is.
    """
    _check_section(config, "")
    _check_scene(config.scene)
    name = scene_name(config)
    if name in ("", ".", "..", "runs") or "/" in name or name.startswith("."):
        raise InputError(
            "scene.name",
            expected="a plain folder name other than 'runs'",
            found=repr(name),
            remedy="Set scene.name to a name for the scene's folder.",
        )
    if config.views.indices is not None and len(config.views.indices) == 0:
        raise InputError(
            "views.indices",
            expected="at least one camera's index",
            found="an empty list",
            remedy="Give indices such as views.indices=[0,2], or views.count=K.",
        )


def _check_section(node: Any, prefix: str) -> None:
    for item in fields(node):
        value, key = getattr(node, item.name), f"{prefix}{item.name}"
        if is_dataclass(value):
            _check_section(value, f"{key}.")
        elif value is not None:
            _check_value(key, value, item.metadata)


def _check_value(key: str, value: Any, rule: Mapping[str, Any]) -> None:
    values = value if isinstance(value, list) else [value]
    if rule["length"] is not None and len(values) != rule["length"]:
        raise InputError(
            key,
            expected=f"{rule['length']} values",
            found=f"{len(values)}: {value}",
            remedy=f"Write it as {key}=[...] with {rule['length']} values.",
        )
    for one in values:
        if rule["choices"] and one not in rule["choices"]:
            raise InputError(
                key, expected=f"one of {', '.join(rule['choices'])}", found=repr(one), remedy="Choose one of them."
            )
        if rule["low"] is not None and not (rule["low"] <= one <= rule["high"] and math.isfinite(one)):
            raise InputError(
                key,
                expected=f"a value from {_short(rule['low'])} to {_short(rule['high'])} ({rule['help']})",
                found=str(one),
                remedy="Choose a value in this range.",
            )


def _check_scene(scene: SceneConfig) -> None:
    what = {"blend": "a .blend file", "external": "a dataset's folder", "ply": "a .ply file"}.get(scene.kind)
    if what is None:
        return
    if scene.path is None:
        raise InputError(
            "scene.path", expected=what, found="nothing", remedy=f"Say which: scene={scene.kind} scene.path=PATH."
        )
    path = Path(scene.path)
    if not (path.is_file() if scene.kind != "external" else path.is_dir()):
        found = "no such file or folder" if not path.exists() else "something else"
        raise InputError(
            path, expected=what, found=found, remedy="Check scene.path; a relative path starts at the current folder."
        )
