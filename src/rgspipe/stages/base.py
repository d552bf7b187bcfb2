"""What a stage is: a name, what it needs, what its result depends on, and the function that makes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rgspipe.config import RgspipeConfig
from rgspipe.renderer.device import chosen_device
from rgspipe.store.artifacts import Artifact
from rgspipe.store.strict_json import as_json

if TYPE_CHECKING:
    import torch

#: Folder under outputs/ of what is of several scenes.
SCENES = "scenes"


@dataclass(frozen=True)
class Need:
    """An input of a stage: the artifact of another one, with the configuration changed where `changes` says so.

    Attributes:
        stage: the other stage's name.
        changes: values by dotted key, such as {"views.count": 3}.
        may_fail: whether the stage goes on without it where it cannot be made.
    """

    stage: str
    changes: Mapping[str, object] = field(default_factory=dict)
    may_fail: bool = False


@dataclass(frozen=True)
class Failure:
    """Why an artifact could not be made.

    Attributes:
        stage: what failed: its own stage, or one before it.
        reason: in words.
    """

    stage: str
    reason: str


@dataclass(frozen=True)
class StageContext:
    """All that a stage's `run` is given.

    Attributes:
        config: the whole configuration; only what `config_keys` names may influence the result.
        inputs: for each needed stage its artifact; the first one where several are needed.
        input_lists: for each needed stage all its artifacts, in the order of the needs, without those that failed.
        folder: where the result goes. After an interruption it still holds what an earlier attempt wrote, so a long
            stage can go on with what `WholeFiles` knows to be whole.
        failures: of needs that may fail: by stage, and by the place among the needs of that stage.
    """

    config: RgspipeConfig
    inputs: Mapping[str, Artifact]
    input_lists: Mapping[str, Sequence[Artifact]]
    folder: Path
    facts: dict[str, Any] = field(default_factory=dict)
    failures: Mapping[str, Mapping[int, Failure]] = field(default_factory=dict)

    def attempts(self, stage: str, count: int) -> list[Artifact | Failure]:
        """What became of the `count` needs of a stage, in their order."""
        made, failed = iter(self.input_lists.get(stage, ())), self.failures.get(stage, {})
        return [failed[place] if place in failed else next(made) for place in range(count)]

    def note(self, **facts: Any) -> None:
        """Keep JSON values in the manifest, under "facts"; see `as_json`."""
        self.facts.update(as_json(facts))

    @cached_property
    def device(self) -> torch.device:
        """Where to compute.

        Raises:
            InputError: a GPU is asked for where there is none.
        """
        return chosen_device(self.config.device)

    @property
    def scratch(self) -> Path:
        """A folder for checkpoints: survives an interruption, is removed when the result is published."""
        folder = self.folder / ".scratch"
        folder.mkdir(exist_ok=True)
        return folder


def _nothing(config: RgspipeConfig) -> tuple[()]:
    return ()


def _no_remarks(config: RgspipeConfig, inputs: Mapping[str, Artifact]) -> tuple[()]:
    return ()


@dataclass(frozen=True)
class Stage:
    """One step of the way from images to lights.

    Its result depends on the code of the module where `run` is and of all that this module imports, too.

    Attributes:
        name: as in `stage=<name>`.
        help: one line for people.
        run: reads artifacts, calls the library, writes files into `context.folder`.
        inputs: which artifacts it needs, for a configuration; a plain name stands for `Need(name)`.
        config_keys: dotted keys (or whole sections) that the result depends on; a function of the configuration
            where that depends on a choice.
        files: files and folders outside the store that the result depends on; their content counts.
        remarks: lines that the plan shows below the stage, from the configuration and, by stage, the artifact itself
            where it is reused, or else those of its inputs that are made already.
        of_scenes: whether it is of no single scene; its results then lie under outputs/scenes/.
        own_keys: of a stage that prints all of `config_keys`, those that count for more than that; None where all do.
    """

    name: str
    help: str
    run: Callable[[StageContext], None]
    inputs: Callable[[RgspipeConfig], Sequence[Need | str]] = _nothing
    config_keys: Sequence[str] | Callable[[RgspipeConfig], Sequence[str]] = ()
    files: Callable[[RgspipeConfig], Sequence[Path]] = _nothing
    remarks: Callable[[RgspipeConfig, Mapping[str, Artifact]], Sequence[str]] = _no_remarks
    of_scenes: bool = False
    own_keys: Sequence[str] | None = None

    def place(self, config: RgspipeConfig) -> str:
        """The folder under outputs/ that its results lie in."""
        return SCENES if self.of_scenes else config.scene.folder

    def needs(self, config: RgspipeConfig) -> tuple[Need, ...]:
        """The inputs for a configuration."""
        return tuple(Need(item) if isinstance(item, str) else item for item in self.inputs(config))

    def keys(self, config: RgspipeConfig) -> tuple[str, ...]:
        """The configuration keys that matter for a configuration."""
        return tuple(self.config_keys(config) if callable(self.config_keys) else self.config_keys)
