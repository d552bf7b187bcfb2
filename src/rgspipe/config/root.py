"""Everything that can be configured: the groups, each in a module of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.blender.options import BlenderOptions, DatasetOptions
from rgspipe.capture.options import CaptureOptions
from rgspipe.config.benchmark import BenchmarkConfig
from rgspipe.config.effects import EffectsConfig
from rgspipe.config.export import ExportConfig
from rgspipe.config.fit import FitConfig
from rgspipe.config.freeze import FreezeConfig
from rgspipe.config.init import InitConfig
from rgspipe.config.light import LightConfig, ViewsConfig
from rgspipe.config.relight import RelightConfig
from rgspipe.config.report import OverviewConfig, ReportConfig
from rgspipe.config.scene import SceneConfig
from rgspipe.config.studies import EvaluateConfig, StudyConfig
from rgspipe.config.targets import TargetsConfig
from rgspipe.config.track import TrackConfig
from rgspipe.config.train import TrainConfig
from rgspipe.config.viewer import ViewerConfig
from rgspipe.datasets.classes import LightClass
from rgspipe.datasets.reading_limits import ReadingLimits
from rgspipe.degradation.options import ModelError, TargetErrors, ViewErrors
from rgspipe.machine.device import Wanted
from rgspipe.options import Options, option


@dataclass(frozen=True)
class AccuracyConfig(Options):
    """Which preset of the accuracy group is in force; the preset sets keys of the other groups."""

    name: Literal["draft", "standard", "reference"] = "standard"
    """preset"""


@dataclass(frozen=True)
class DebugConfig(Options):
    """What is shown when something goes wrong."""

    traceback: bool = False
    """show the traceback of an error on the terminal as well"""


@dataclass(frozen=True)
class RgspipeConfig(Options):
    """Everything that can be configured."""

    # Three question marks are Hydra's word for a value that has to be given.
    stage: str = "???"
    """what to run"""
    upstream: Literal["build", "require"] = "build"
    """what to do about missing inputs"""
    outputs: str = "outputs"
    """folder of artifacts and reports, relative to the current one"""
    device: Wanted = "auto"
    """where training, freezing, fitting and relighting compute; auto: on a CUDA GPU where there is one"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """seed of the fit's own draws"""
    occlusion: Literal[LightClass, "all"] = "all"
    """class of fit targets"""
    scene: SceneConfig = SceneConfig()
    dataset: DatasetOptions = DatasetOptions()
    blender: BlenderOptions = BlenderOptions()
    capture: ViewErrors = ViewErrors()
    init: InitConfig = InitConfig()
    train: TrainConfig = TrainConfig()
    lamps: CaptureOptions = CaptureOptions()
    freeze: FreezeConfig = FreezeConfig()
    export: ExportConfig = ExportConfig()
    views: ViewsConfig = ViewsConfig()
    light: LightConfig = LightConfig()
    fit: FitConfig = FitConfig()
    effects: EffectsConfig = EffectsConfig()
    accuracy: AccuracyConfig = AccuracyConfig()
    evaluate: EvaluateConfig = EvaluateConfig()
    study: StudyConfig = StudyConfig()
    report: ReportConfig = ReportConfig()
    overview: OverviewConfig = OverviewConfig()
    benchmark: BenchmarkConfig = BenchmarkConfig()
    debug: DebugConfig = DebugConfig()
    limits: ReadingLimits = ReadingLimits()
    model_error: ModelError = ModelError()
    target_capture: TargetErrors = TargetErrors()
    track: TrackConfig = TrackConfig()
    targets: TargetsConfig = TargetsConfig()
    relight: RelightConfig = RelightConfig()
    viewer: ViewerConfig = ViewerConfig()
