"""The formats' own validators find nothing wrong: `make third-party` installs them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rgspipe.light_export.export import export_lights
from rgspipe.scene.lights import KINDS

LIGHTS = [kind.shaped() for kind in KINDS.values()]

#: Where `make third-party` puts the validator of glTF.
NODE_MODULES = Path(sys.prefix) / "npm" / "node_modules"

VALIDATE = """
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));
require('gltf-validator').validateBytes(bytes).then(report => console.log(JSON.stringify(report.issues)));
"""


def test_usd_finds_nothing_wrong(tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd", reason="usd-core is not installed (make third-party)")
    from pxr import UsdLux, UsdValidation

    (path,) = export_lights(LIGHTS, tmp_path, ["usda"]).files
    stage = usd.Stage.Open(str(path))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert UsdValidation.ValidationContext(validators).Validate(stage) == []
    found = [UsdLux.LightAPI(prim) for prim in stage.Traverse() if prim.HasAPI(UsdLux.LightAPI)]
    assert (
        len(found) == len(LIGHTS) and found[0].GetIntensityAttr().Get() == 4.0
    )  # of 1 W/sr: πr²L of a sphere whose radiance L is 4I over 4πr²


@pytest.mark.skipif(
    shutil.which("node") is None or not (NODE_MODULES / "gltf-validator").is_dir(),
    reason="gltf-validator is not installed (make third-party)",
)
def test_gltf_finds_nothing_wrong(tmp_path: Path) -> None:
    (path,) = export_lights(LIGHTS, tmp_path, ["gltf"]).files
    environment = os.environ | {"NODE_PATH": str(NODE_MODULES)}
    done = subprocess.run(
        ["node", "-e", VALIDATE, str(path)], env=environment, capture_output=True, text=True, check=True
    )
    issues = json.loads(done.stdout)
    assert issues["numErrors"] == issues["numWarnings"] == 0, issues["messages"]
