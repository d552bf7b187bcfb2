"""Bring a capture in another program's layout (scene=rgbd, scene=mesh) into our own: poses, photographs, depth."""

from __future__ import annotations

from pathlib import Path

from rgspipe.capture.refusals import OFF, check_views
from rgspipe.config import RgspipeConfig
from rgspipe.config.spoken import as_keys
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.mesh.links import mesh_files
from rgspipe.datasets.scans.frame import Scan
from rgspipe.datasets.scans.importing import Imported, import_scan
from rgspipe.datasets.scans.layouts import read_scan
from rgspipe.errors import InputError
from rgspipe.renderer.mesh_passes import MeshPasses
from rgspipe.scene.mesh import TriangleMesh
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.images.mesh_conventions import check_mesh
from rgspipe.stages.images.odd_views import tell_astray, tell_odd_views
from rgspipe.stages.images.scan_conventions import check_images, check_scan
from rgspipe.stages.sources import mesh_path


def run(context: StageContext) -> None:
    """Write a dataset without lights, whose views agree with each other, and with the mesh if there is one."""
    config, options = context.config, context.config.scene.rgbd
    scan = _scan(config)
    mesh = _mesh(config) if config.scene.kind == "mesh" else None
    imported = import_scan(scan, options, context.folder, None if mesh is None else MeshPasses(mesh).seen_by)
    views = load_dataset(context.folder, targets=False).train
    check_views(views, scan.stated)
    names = [frame.image.name for frame in scan.frames]
    if mesh is None:
        _require_depth(scan, imported)
        check_scan(scan, views)
        check_images(scan, views)
        tell_astray(views, names)
    else:
        check_mesh(scan, views, mesh, mesh_path(config), config.scene.mesh)
    tell_odd_views(views, names)
    for words in (imported.words(scan.layout), *(() if mesh is None else mesh.remarks)):
        print(as_keys(words))
    context.note(layout=scan.layout, frames=imported.frames, with_depth=imported.with_depth, exif=imported.exif)


def _mesh(config: RgspipeConfig) -> TriangleMesh:
    from rgspipe.datasets.mesh.file import read_mesh  # slow to import (trimesh), and captures have none

    return read_mesh(mesh_path(config), config.scene.mesh)


def _require_depth(scan: Scan, imported: Imported) -> None:
    """Refuse a capture whose depth images measured nothing: its surfaces come of them.

    Raises:
        InputError: no pixel of any photograph has depth that is known and used.
    """
    if not imported.with_depth:
        raise InputError(
            scan.stated,
            expected="depth that is known in some pixels of some photographs",
            found=f"none in any of {imported.frames}: 0 or nothing everywhere, or left out by masks",
            remedy="Export depth again, and check that masks are not the wrong way round (black is left out).",
        )


def _scan(config: RgspipeConfig) -> Scan:
    """The capture, with others of the same room."""
    options, depth = config.scene.rgbd, config.scene.kind != "mesh"
    scan = read_scan(_folder(config), options, depth=depth)
    for number, folder in enumerate(options.others):
        scan = scan.joined(read_scan(folder, options, depth=False), f"{number + 2}")
    return scan if options.lamps_off is None else scan.joined(read_scan(options.lamps_off, options, depth=False), OFF)


def _folder(config: RgspipeConfig) -> Path:
    """Where photographs and cameras are."""
    scene = config.scene
    if scene.kind == "mesh":
        return mesh_path(config).parent if scene.mesh.photographs is None else Path(scene.mesh.photographs).resolve()
    if scene.kind != "rgbd" or scene.path is None:
        found = f"scene.kind={scene.kind}"
        raise InputError("scene", expected="scene=rgbd", found=found, remedy="Add scene=rgbd scene.path=DIR.")
    return Path(scene.path).resolve()


def _files(config: RgspipeConfig) -> list[Path]:
    """The files of the frames that are taken, those that describe them, and those of the mesh."""
    scan = _scan(config)
    files = [*scan.sources, *(path for frame in scan.frames for path in frame.files)]
    files += mesh_files(mesh_path(config)) if config.scene.kind == "mesh" else []
    return [path for path in dict.fromkeys(files) if _is_there(path)]


def _is_there(path: Path) -> bool:
    """Whether a file can be hashed; what cannot is told when it is read."""
    try:
        return path.is_file()
    except OSError:  # a name that is too long
        return False


STAGE = Stage(
    name="import_scan",
    help="brings a capture in the layout of another program (scene=rgbd, scene=mesh) into our own",
    run=run,
    config_keys=("scene.kind", "scene.rgbd", "scene.mesh"),
    files=_files,
)
