"""`purelight-render`: a Mitsuba scene with PureLight's lamps becomes a picture."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from purelight_format.errors import PureLightError
from purelight_mitsuba import platform

COMMAND = "purelight-render"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=COMMAND, description=__doc__)
    parser.add_argument("scene", type=Path, help="Mitsuba 3 scene, .xml")
    parser.add_argument("--output", type=Path, required=True, help=".exr; a .png appears beside it")
    parser.add_argument("--mode", choices=("accurate", "fast"), help="instead of the scene's")
    parser.add_argument("--spp", type=int, help="samples per pixel, instead of the scene's")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--seed", type=int, default=0)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code, 2 for a fault the user can mend."""
    arguments = _parser().parse_args(argv)
    try:
        _check(arguments)
        return _render(arguments)
    except PureLightError as error:
        print(f"{COMMAND}: error: {error}", file=sys.stderr)
    except OSError as error:
        print(f"{COMMAND}: error: {error.filename}: {error.strerror}", file=sys.stderr)
    return 2


def _check(arguments: argparse.Namespace) -> None:
    """Finds the faults that need no renderer before a long rendering does."""
    scene, output = arguments.scene, arguments.output
    if not scene.is_file():
        raise PureLightError(f"{scene}: no such file; give a Mitsuba scene")
    if scene.suffix.lower() != ".xml":
        raise PureLightError(f"{scene}: not a Mitsuba scene; its name must end in .xml")
    if output.suffix.lower() != ".exr":
        raise PureLightError(f"{output}: the picture's name must end in .exr")
    if not output.parent.is_dir():
        raise PureLightError(f"{output.parent}: no such folder; create it first")
    if arguments.spp is not None and arguments.spp < 1:
        raise PureLightError("--spp must be at least 1")


def _render(arguments: argparse.Namespace) -> int:
    mi = platform.use(arguments.variant)
    mi.set_log_level(mi.LogLevel.Error)

    from purelight_format import atomic
    from purelight_mitsuba.integrator import SpoiltWarning
    from purelight_mitsuba.passes import integrator_for, load_scene, render_passes
    from purelight_onnx.picture import png, write_exr

    scene = load_scene(arguments.scene)
    integrator = integrator_for(scene, arguments.mode)
    spp = arguments.spp or scene.sensors()[0].sampler().sample_count()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SpoiltWarning)
        image = render_passes(scene, integrator, spp, arguments.seed, progress=True)
    write_exr(arguments.output, image)
    preview = arguments.output.with_suffix(".png")
    atomic.write_bytes(preview, png(image))
    if integrator.spoilt:
        print(f"{COMMAND}: warning: {integrator.spoilt_message()}", file=sys.stderr)
    print(f"{arguments.output}, {preview}: {spp} samples per pixel, {integrator.mode}")
    return 0
