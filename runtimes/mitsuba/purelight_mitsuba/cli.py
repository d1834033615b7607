"""`purelight-render`: a Mitsuba or USD scene with PureLight's lamps becomes a picture."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from purelight_format import atomic, command
from purelight_format.errors import PureLightError, SpoiltWarning
from purelight_mitsuba import platform

COMMAND = "purelight-render"
USD = (".usda", ".usd", ".usdc", ".usdz")


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    parser.add_argument("scene", type=Path, help="Mitsuba 3 scene, .xml, or a USD stage")
    parser.add_argument("--output", type=Path, required=True, help=".exr; a .png appears beside it")
    parser.add_argument("--mode", choices=("accurate", "fast"), help="instead of the scene's")
    parser.add_argument("--engine", choices=("auto", "fused", "queued"), help="of the networks")
    parser.add_argument("--spp", type=int, help="samples per pixel, instead of the scene's")
    parser.add_argument("--width", type=int, help="of the picture, instead of the scene's")
    parser.add_argument("--camera", help="of a USD stage, the path of its prim")
    parser.add_argument("--frame", type=float, help="of a USD stage, its time code")
    parser.add_argument("--aovs", action="store_true", help="add albedo, normal and depth layers")
    parser.add_argument("--light-groups", action="store_true", help="add a layer per lamp's light")
    parser.add_argument("--denoise", action="store_true", help="by Open Image Denoise")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--seed", type=command.seed, default=0)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code, 2 for a fault the user can mend."""
    return command.run(COMMAND, lambda: _act(_parser().parse_args(argv)))


def _act(arguments: argparse.Namespace) -> int:
    _check(arguments)
    return _render(arguments)


def _check(arguments: argparse.Namespace) -> None:
    """Finds the faults that need no renderer before a long rendering does."""
    scene, output = arguments.scene, arguments.output
    if not scene.is_file():
        raise PureLightError(f"{scene}: no such file; give a Mitsuba scene")
    if scene.suffix.lower() not in (".xml", *USD):
        raise PureLightError(
            f"{scene}: neither a Mitsuba scene nor a USD stage; its name must end in .xml or "
            f"{', '.join(USD)}"
        )
    usd_only = [f"--{n}" for n in ("camera", "frame") if getattr(arguments, n) is not None]
    if usd_only and scene.suffix.lower() == ".xml":
        raise PureLightError(f"{usd_only[0]} is for USD stages; a Mitsuba scene has its own")
    if output.suffix.lower() != ".exr":
        raise PureLightError(f"{output}: the picture's name must end in .exr")
    for name in ("spp", "width"):
        if getattr(arguments, name) is not None and getattr(arguments, name) < 1:
            raise PureLightError(f"--{name} must be at least 1")
    atomic.check_file(output)


def _render(arguments: argparse.Namespace) -> int:
    mi = platform.use(arguments.variant)
    mi.set_log_level(mi.LogLevel.Error)

    from purelight_format.srgb import png
    from purelight_mitsuba.output import advice, denoise, first_hit, passes
    from purelight_mitsuba.transport.media import MediaWarning
    from purelight_onnx.picture import write_exr

    if arguments.denoise:
        denoise.require(arguments.variant)
    scene = _load(arguments)
    if arguments.denoise and (line := denoise.against_filter(scene.sensors()[0].film())):
        command.warn(COMMAND, line)
    if arguments.width is not None:
        passes.resize(scene, arguments.width)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MediaWarning)
        integrator = passes.integrator_for(
            scene, arguments.mode, arguments.engine, light_groups=arguments.light_groups or None
        )
    if line := passes.replaced(scene):
        command.warn(COMMAND, line)
    if integrator.prepare(scene).media:
        command.warn(COMMAND, integrator.prepare(scene).media)
    for line in advice.against_fast_mode(scene) if integrator.mode == "fast" else ():
        command.warn(COMMAND, line)
    spp = arguments.spp or scene.sensors()[0].sampler().sample_count()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SpoiltWarning)
        image, layers = passes.render_passes(scene, integrator, spp, arguments.seed, progress=True)
    image, alpha = image[..., :3], image[..., 3:]
    if arguments.denoise or arguments.aovs:
        hides = integrator.hide_emitters
        seen = first_hit.layers(scene, arguments.seed, hide_emitters=hides)
    if arguments.denoise:
        image, layers = denoise.denoised(image, layers, seen)
    if arguments.aovs:
        layers |= seen
    write_exr(arguments.output, image, layers=layers, alpha=alpha if alpha.size else None)
    preview = arguments.output.with_suffix(".png")
    atomic.write_bytes(preview, png(image))
    if integrator.spoilt:
        command.warn(COMMAND, str(SpoiltWarning(integrator.spoilt)))
    print(f"{arguments.output}, {preview}: {spp} samples per pixel, {integrator.mode}")
    return 0


def _load(arguments: argparse.Namespace) -> Any:
    """The scene, with a warning for each thing on a USD stage that is not rendered as it says."""
    from purelight_mitsuba.output.passes import load_scene
    from purelight_mitsuba.usd_scene import load_usd

    if arguments.scene.suffix.lower() not in USD:
        return load_scene(arguments.scene)
    pixel_filter = "box" if arguments.denoise else "gaussian"
    loaded = load_usd(
        arguments.scene, view=arguments.camera, frame=arguments.frame, pixel_filter=pixel_filter
    )
    for note in loaded.notes:
        command.warn(COMMAND, note)
    return loaded.scene
