"""`python -m rgspipe verify`: whether every artifact is as it was made, to the last bit."""

from __future__ import annotations

from collections.abc import Sequence

from rgspipe.cli.messages import EXIT_INPUT, show_input_error
from rgspipe.cli.runs import given_outputs
from rgspipe.datasets.input_file import input_folder
from rgspipe.errors import InputError
from rgspipe.progress import progress_bar
from rgspipe.store.artifacts import Artifact, ArtifactStore
from rgspipe.store.retention import artifact_keys


def verify(arguments: Sequence[str]) -> int:
    """Read every file of every artifact below outputs (or `outputs=DIR`); say which are damaged.

    Returns:
        the exit status: 2 if any is.
    """
    outputs = input_folder(given_outputs(arguments, "verify"), "the folder of results")
    keys = list(artifact_keys(outputs))
    whole: list[Artifact] = []
    for key in progress_bar(keys, "reading", unit="artifact"):
        try:
            artifact = ArtifactStore(outputs).find(key)
            assert artifact is not None
            artifact.folder()
        except InputError as error:
            show_input_error(error)
        except OSError as error:
            place, remedy = error.filename or str(key), "Ask whoever owns it for the right to read it."
            show_input_error(InputError(place, expected="a file to read", found=str(error.strerror), remedy=remedy))
        else:
            whole.append(artifact)
    size = sum(entry["bytes"] for artifact in whole for entry in artifact.manifest["files"].values())
    print(f"{len(whole)} of {len(keys)} artifacts in {outputs} are as they were made ({size / 1e6:.1f} MB)")
    return 0 if len(whole) == len(keys) else EXIT_INPUT
