"""Cycles as a measuring instrument: unbiased, linear, reproducible."""

from __future__ import annotations

import bpy

from rgspipe.blender.interpreter import no_denoiser
from rgspipe.blender.job import RenderSettings
from rgspipe.blender.nodes import tree_of

#: Width of the pixel filter [pixels] that makes a single sample fall on the pixel's centre.
CENTER_FILTER_WIDTH = 0.01


def configure(scene: bpy.types.Scene, settings: RenderSettings) -> None:
    """Set everything that decides what a rendered number means; what Blender would otherwise approximate is off.

    By default Cycles stops sampling lights below 0.01 (up to 6 % too dark in dim pixels) and clamps
    bright indirect samples at 10 (a bias).
    """
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    for bounces in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
        setattr(cycles, bounces, settings.max_bounces)
    cycles.transparent_max_bounces = max(settings.max_bounces, 8)
    cycles.light_sampling_threshold = 0.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.use_adaptive_sampling = False
    cycles.use_fast_gi = False
    cycles.use_light_tree = False  # one light needs no tree: a fifth faster, the same image
    cycles.blur_glossy = 0.0
    cycles.film_exposure = 1.0
    if settings.denoise:
        _configure_denoiser(cycles)
    _configure_output(scene, settings)
    _make_world_black(scene)


def use_colour_sampling(scene: bpy.types.Scene, samples: int, denoise: bool, seed: int) -> None:
    """The mean over each pixel (box filter), many samples."""
    cycles = scene.cycles
    cycles.samples, cycles.seed = samples, seed
    cycles.use_denoising = denoise
    cycles.pixel_filter_type = "BOX"


def use_center_sampling(scene: bpy.types.Scene) -> None:
    """One sample through each pixel's centre: depth, normals and albedo of one surface, not a mixture."""
    cycles = scene.cycles
    cycles.samples, cycles.seed = 1, 0
    cycles.use_denoising = False
    cycles.pixel_filter_type = "GAUSSIAN"
    cycles.filter_width = CENTER_FILTER_WIDTH


def _configure_denoiser(cycles: bpy.types.PropertyGroup) -> None:
    try:
        cycles.denoiser = "OPENIMAGEDENOISE"
    except TypeError:  # its enumeration has no such value
        raise no_denoiser() from None
    cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL"
    cycles.denoising_prefilter = "ACCURATE"
    if bpy.app.version >= (4, 2, 0):
        cycles.denoising_use_gpu = False


def _configure_output(scene: bpy.types.Scene, settings: RenderSettings) -> None:
    render = scene.render
    render.resolution_x = render.resolution_y = settings.resolution
    render.resolution_percentage = 100
    render.film_transparent = True
    render.use_persistent_data = True
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_diffuse_color = True
    output = render.image_settings
    if bpy.app.version >= (5, 0, 0):
        output.media_type = "MULTI_LAYER_IMAGE"
    output.file_format = "OPEN_EXR_MULTILAYER"
    output.color_depth = "32"
    output.exr_codec = "NONE"


def _make_world_black(scene: bpy.types.Scene) -> None:
    world = bpy.data.worlds.new("black")
    tree_of(world).nodes["Background"].inputs["Strength"].default_value = 0.0
    world.cycles.sampling_method = "NONE"
    scene.world = world
