"""What of its configuration a training's result depends on."""

from __future__ import annotations

from rgspipe.config import RgspipeConfig
from rgspipe.config.train import TrainConfig
from rgspipe.options import settings
from rgspipe.stages.train_surfels import NO_RESULT, STAGE


def test_a_training_can_be_resumed_with_less_memory() -> None:
    left_out = {f"train.{setting.name}" for setting in settings(TrainConfig)} - set(STAGE.keys(RgspipeConfig()))
    assert left_out == {f"train.{name}" for name in NO_RESULT}
