"""Where the surfels of a scene come from: training, the truth that a rendered scene knows, or a file from elsewhere."""

from __future__ import annotations

from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.input_file import input_folder
from rgspipe.errors import InputError

#: Names of a folder that are told.
SHOWN = 5


def surfel_stage(config: RgspipeConfig) -> str:
    """The stage whose surfels.safetensors is the scene.

    Raises:
        InputError: true surfaces are wanted of a scene that is a file.
    """
    if config.scene.kind == "ply":
        if config.freeze.surfels == "truth":
            raise InputError(
                "freeze.surfels",
                expected="trained, for scene=ply: its surfels are frozen as they are",
                found="truth, and no surfaces but those of the file are known",
                remedy="Leave freeze.surfels away.",
            )
        return "import_ply"
    return "true_surfels" if config.freeze.surfels == "truth" else trained_stage(config)


def trained_stage(config: RgspipeConfig) -> str:
    """The stage that makes surfels of photographs: by lamps that are known, or with lamps that are found."""
    return "train_surfels" if config.scene.lamps == "known" else "capture_surfels"


def has_truth(config: RgspipeConfig) -> bool:
    """Whether the scene is one that Blender renders, with passes of its true surfaces."""
    return config.scene.kind not in ("external", "ply", "rgbd", "mesh")


def image_stage(config: RgspipeConfig) -> list[str]:
    """The stage that has the scene's images, if there are any."""
    return [] if config.scene.kind == "ply" else ["generate_dataset"]


def target_stage(config: RgspipeConfig) -> list[str]:
    """The stage that has the fit targets of the scene and their truth, if there is one."""
    if config.fit.target is None and config.fit.targets == "generated":
        return ["generate_targets"]
    return image_stage(config)


def check_target(folder: str | Path) -> None:
    """Refuse a folder of photographs, say, that does not tell where their cameras were.

    Raises:
        InputError: says what a target is.
    """
    folder = input_folder(folder, "the folder of a fit target")
    if not (folder / "transforms.json").exists():
        names = sorted(path.name for path in folder.iterdir())
        more = ", …" if len(names) > SHOWN else ""
        raise InputError(
            folder,
            expected="images and a transforms.json, which tells where their cameras were",
            found=f"no such file among {', '.join(names[:SHOWN])}{more}" if names else "an empty folder",
            remedy="docs/guides/your_own_scene.md says what stands in it, "
            "docs/guides/photographs.md what to do where no camera is known.",
        )


def require_images(config: RgspipeConfig, what: str) -> None:
    """Refuse a scene that has no images.

    Raises:
        InputError: the scene is surfels from a file.
    """
    if config.scene.kind == "ply":
        raise InputError(
            f"stage={config.stage}",
            expected=f"a scene with images, for {what}",
            found=f"scene=ply: finished surfels in {Path(config.scene.path or '')}",
            remedy="Freeze them (stage=freeze), fit lights in images of your own (stage=fit_light fit.target=DIR), "
            "or export them (stage=export).",
        )


def mesh_path(config: RgspipeConfig) -> Path:
    """The file of scene=mesh.

    Raises:
        InputError: the scene is another one, or names no file.
    """
    if config.scene.kind != "mesh" or config.scene.path is None:
        found = f"scene.kind={config.scene.kind}"
        raise InputError("scene", expected="scene=mesh", found=found, remedy="Add scene=mesh scene.path=FILE.")
    return Path(config.scene.path).resolve()
