"""The schema, the groups that extend it, and what is refused."""

from __future__ import annotations

import itertools

import pytest

from rgspipe.cli.compose import compose_config, leaves_machine
from rgspipe.cli.sweep_check import check_sweep
from rgspipe.config import RgspipeConfig, get_value, with_changes
from rgspipe.config.core import build, describe, plain
from rgspipe.errors import InputError
from rgspipe.machine.resources import resource_folder

CHOICES = sorted(
    (path.parent.name, path.stem) for path in resource_folder("conf").glob("*/*.yaml") if path.parent.name != "scene"
)


def composed(*overrides: str) -> RgspipeConfig:
    return compose_config(["stage=freeze", *overrides])


@pytest.mark.parametrize(("group", "choice"), CHOICES)
def test_every_choice_of_every_group_composes(group: str, choice: str) -> None:
    composed(f"{group}={choice}")


def test_presets_combine() -> None:
    for accuracy, views in itertools.product(("draft", "reference"), ("single", "multi")):
        config = composed(f"accuracy={accuracy}", f"views={views}", "experiment=smoke")
        assert config.accuracy.name == accuracy
    assert config.init.surfels == 2500, "the experiment has the last word among presets"
    assert composed("experiment=smoke", "init.surfels=300").init.surfels == 300


def test_scene_kinds_need_their_path(tmp_path) -> None:
    assert composed("scene=cornell").scene.folder == "cornell"
    assert composed("scene=external", f"scene.path={tmp_path}").scene.folder == tmp_path.name
    blend = tmp_path / "room.blend"
    blend.touch()
    assert composed("scene=blend", f"scene.path={blend}").scene.folder == "room"
    assert composed("scene=blend", f"scene.path={blend}", "scene.name=hall").scene.folder == "hall"


def test_choosing_a_method_by_group_or_by_key_means_the_same() -> None:
    # The report asks for fits by key, people by group: both must name the same artifact.
    assert composed("fit=paper_adam") == composed("fit.method=paper_adam")
    assert composed("views=multi") == composed("views.count=3")


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("dataset.resolutoin=64", ["dataset.resolutoin", "dataset.resolution"]),
        ("resolution=64", ["Did you mean", "dataset.resolution"]),
        ("scnee=cornell", ["scnee", "Did you mean scene"]),
        ("port=8600", ["Did you mean viewer.port or report"]),
        ("ligth.count=2", ["Did you mean light.count or relight.count or light.mount?"]),
        ("=", ["'='", "--help lists the keys"]),
        ("+foo=1", ["foo", "no such key"]),
        ("++fit.serach.starts=1", ["fit.search.starts"]),
        ("+dataset.foo=1", ["dataset.foo"]),
        ("~fit", ["~fit"]),
        ("scene=cornel", ["scene=cornell", "external"]),
        ("fit=", ["search_lm"]),
        ("scene=[[1]]", ["scene:", "cornell", "[[1]]", "scene=NAME"]),
        ("fit=" + 300 * "x", ["fit:", "search_lm", "xxx…", "fit=NAME"]),
        ("effects=${seed}", ["effects:", "${seed}", "effects=NAME"]),
        ("+accuracy=inf", ["accuracy:", "draft", "inf"]),
        ("hydra/launcher=3", ["hydra/launcher:", "3"]),
        ("hydra.luncher=x", ["hydra.launcher"]),
        ("hydra.launcher.n_job=2", ["hydra.launcher.n_jobs"]),
        ("+hydra.foo=1", ["hydra.foo"]),
        ("hydra/launcher=jolib", ["hydra/launcher=joblib"]),
        ("dataset.resolution=abc", ["dataset.resolution", "whole number", "abc"]),
        ("dataset.resolution=2.5", ["dataset.resolution"]),
        ("dataset.denoise=maybe", ["dataset.denoise", "true or false"]),
        ("dataset.resolution=null", ["dataset.resolution", "null"]),
        ("views.indices=[a]", ["views.indices", "whole number"]),
        ("dataset=3", ["dataset:", "dataset.resolution", "3"]),
        ("dataset.resolution=4", ["dataset.resolution", "8 to 8192", "4"]),
        ("views.count=0", ["views.count"]),
        ("views.indices=[]", ["views.indices"]),
        ("occlusion=behind", ["occlusion", "out_of_frame"]),
        ("fit.method=adam", ["fit.method", "paper_adam"]),
        ("fit.adam.ssim_weight=nan", ["fit.adam.ssim_weight"]),
        ("scene.cornell.room=[1,1]", ["scene.cornell.room", "3 values"]),
        ("train.loss=l1_ssim", ["train.window", "windows"]),
        ("scene.ply.crop=[0,0,0,1,-1,1]", ["scene.ply.crop", "upper corner"]),
        ("scene.name=runs", ["scene.name"]),
        ("scene.name=a/b", ["scene.name"]),
        ("scene=external", ["scene.path", "folder"]),
        ("scene=rgbd", ["scene.path", "capture's folder"]),
        ("scene.rgbd.format=arkit", ["scene.rgbd.format", "polycam"]),
        ("upstream=maybe", ["upstream", "require"]),
        ("seed=1,2", ["seed", "-m"]),
        ("seed=[1", ["seed=[1"]),
        ("fit_light", ["stage=fit_light"]),
    ],
)
def test_what_makes_no_sense_is_refused_with_the_key_and_a_way_out(override: str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        composed(override)
    message = str(caught.value)
    for word in words:
        assert word in message
    assert "\n" not in message


def test_hydra_settings_that_exist_are_accepted() -> None:
    composed("hydra.launcher.n_jobs=2", "+hydra.job.env_set.A=1")
    composed("hydra/launcher=basic", "hydra.verbose=true")
    composed("launcher=slurm", "hydra.launcher.partition=gpu", "+hydra.launcher.additional_parameters.mail-type=END")
    composed("hydra/launcher=slurm", "hydra.launcher.setup=[module load cuda]")


def test_keys_of_a_launcher_are_those_of_the_chosen_one() -> None:
    for launcher in ("launcher=slurm", "hydra/launcher=slurm"):
        with pytest.raises(InputError, match=r"partitoin.*Did you mean hydra\.launcher\.partition"):
            composed(launcher, "hydra.launcher.partitoin=gpu")
    with pytest.raises(InputError, match="no such key"):
        composed("hydra.launcher.partition=gpu")


@pytest.mark.parametrize("group", ["launcher", "hydra/launcher"])
def test_a_cluster_s_launcher_is_known(group: str) -> None:
    assert leaves_machine(["stage=freeze", f"{group}=slurm"])
    assert not leaves_machine(["stage=freeze", f"{group}=joblib"]) and not leaves_machine(["stage=freeze"])
    with pytest.raises(InputError, match="joblib"):
        leaves_machine([f"{group}=slurmm"])


def test_a_missing_stage_lists_the_stages() -> None:
    with pytest.raises(InputError, match="generate_dataset"):
        compose_config([])


def test_a_sweep_is_checked_before_it_starts() -> None:
    assert check_sweep(["stage=freeze", "seed=3,4", "fit=search_lm,paper_adam"]).seed == 3
    with pytest.raises(InputError, match=r"views\.count"):
        check_sweep(["stage=freeze", "views.count=1,0"])
    with pytest.raises(InputError, match="fit=paper_adam"):
        check_sweep(["stage=freeze", "fit=search_lm,paper_adm"])
    with pytest.raises(InputError, match="seed"):
        check_sweep(["stage=freeze", "seed=range(-2,1)"])


def test_values_are_read_and_changed_by_dotted_key() -> None:
    config = composed()
    changed = with_changes(config, {"fit.method": "paper_adam", "views.count": 3})
    assert get_value(changed, "fit.method") == "paper_adam"
    assert get_value(changed, "views") == {"count": 3, "indices": None}
    assert get_value(config, "views.count") == 1
    for call in (lambda: get_value(config, "fit.foo"), lambda: with_changes(config, {"fit.foo": 1})):
        with pytest.raises(ValueError, match=r"fit\.foo"):
            call()


def test_changes_are_made_all_at_once_and_what_does_not_go_together_is_refused_with_the_whole_key() -> None:
    assert with_changes(composed(), {"train.loss": "l1_ssim", "train.window": 48}).train.window == 48
    with pytest.raises(InputError, match=r"^train\.window: .*single pixels"):
        with_changes(composed(), {"train.loss": "l1_ssim"})


def test_plain_values_are_built_into_the_same_configuration() -> None:
    config = composed("views.indices=[0,2]", "scene.ply.cameras=a/cameras.json", "light.count=null")
    assert build(RgspipeConfig, plain(config)) == config
    assert plain(config)["scene"]["ply"]["cameras"] == "a/cameras.json"
    with pytest.raises(InputError, match=r"^fit\.search\.start: .*Did you mean fit\.search\.starts"):
        build(RgspipeConfig, {"fit": {"search": {"start": 3}}})


def test_every_key_says_what_it_is() -> None:
    for key, help, _ in describe(RgspipeConfig()):
        assert len(help) > 3, key
