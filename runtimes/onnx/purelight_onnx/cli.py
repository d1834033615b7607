"""`purelight-view`: a picture of a bundle, without a renderer; or a page to turn it in."""

from __future__ import annotations

import argparse
import math
import os
import warnings
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from purelight_format import atomic, command
from purelight_format.camera import Camera
from purelight_format.errors import PureLightError, SpoiltWarning
from purelight_format.networks.kinds import KINDS
from purelight_format.srgb import png
from purelight_onnx import web_page
from purelight_onnx.luminaire import Luminaire
from purelight_onnx.picture import write_exr
from purelight_onnx.viewer import render

COMMAND = "purelight-view"
BRIGHTEST = 1e30  # Far below where float32 ends, so that sums of it stay finite.
STOPS = 100


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _run(_parser().parse_args(argv)))


def _run(options: argparse.Namespace) -> int:
    return write_page(options) if options.web else view(options)


def write_page(options: argparse.Namespace) -> int:
    """Writes a page with the lamp inside."""
    if options.output.suffix.lower() != ".html":
        raise PureLightError(f"{options.output}: the page's name must end in .html")
    plain = _parser().parse_args([str(options.bundle), "--output", str(options.output)])
    kept = ("bundle", "output", "web", "threads")
    idle = [k for k, v in vars(options).items() if k not in kept and v != getattr(plain, k)]
    if idle:
        raise PureLightError(f"--web writes a page, which has no use for --{idle[0]}")
    atomic.check_file(options.output)
    luminaire = Luminaire.open(options.bundle, threads=options.threads)
    for name in luminaire.manifest.networks.keys() & KINDS.keys():
        luminaire.network(name)  # The page refuses a lamp that misses its golden vectors.
    web_page.write(options.output, luminaire.bundle)
    return 0


def view(options: argparse.Namespace) -> int:
    """Renders and writes the picture and its preview."""
    if options.output.suffix.lower() != ".exr":
        raise PureLightError(f"{options.output}: the picture's name must end in .exr")
    if not 1 <= options.spp <= 65536 or options.seed < 0:
        raise PureLightError("--spp must be 1 to 65,536 and --seed at least 0")
    if not all(0 <= level <= BRIGHTEST for level in options.background):
        raise PureLightError(f"--background must be 0 to {BRIGHTEST:g} W/(m2 sr)")
    if not abs(options.exposure or 0.0) <= STOPS:
        raise PureLightError(f"--exposure must be -{STOPS} to {STOPS} stops")
    if not math.isfinite(options.azimuth):
        raise PureLightError("--azimuth must be a finite number of degrees")
    for path in (options.output, options.output.with_suffix(".png")):
        atomic.check_file(path)
    luminaire = Luminaire.open(options.bundle, threads=options.threads)
    camera = Camera.orbit(
        luminaire.manifest.bounding_sphere,
        azimuth=options.azimuth,
        elevation=options.elevation,
        distance=options.distance,
        size=options.size,
        lens=options.lens,
    )
    total = options.spp * options.size**2
    with (
        tqdm(total=total, unit="ray", unit_scale=True, desc="view", delay=1) as bar,
        warnings.catch_warnings(record=True) as told,
    ):
        warnings.simplefilter("always", SpoiltWarning)
        image = render(
            luminaire, camera, samples=options.spp, background=options.background,
            seed=options.seed, progress=bar.update,
        )  # fmt: skip
    for warning in told:
        command.warn(COMMAND, str(warning.message))
    write_exr(options.output, image, half=options.half)
    atomic.write_bytes(options.output.with_suffix(".png"), png(image, options.exposure))
    return 0


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    add = parser.add_argument
    add("bundle", type=Path, help="the lamp, a .plux file")
    add("--output", type=Path, required=True, help="picture.exr; a .png preview goes beside it")
    add(
        "--web",
        action="store_true",
        help="write page.html instead: the lamp in a page that opens in any browser, from disk",
    )
    add("--size", type=int, default=256, help="pixels along each side")
    add("--spp", type=int, default=4, help="rays per pixel")
    add("--azimuth", type=float, default=30.0, help="degrees from +X")
    add("--elevation", type=float, default=10.0, help="degrees above the horizon")
    add("--distance", type=float, default=4.0, help="from the centre, in radii of the lamp")
    add("--lens", type=float, default=0.0, help="radius of a thin lens, in radii of the lamp")
    add("--background", type=float, nargs=3, default=(0.0, 0.0, 0.0), metavar=("R", "G", "B"))
    add("--exposure", type=float, help="stops of the preview (default: by the picture)")
    add("--half", action="store_true", help="half floats in the EXR file")
    add("--seed", type=int, default=0)
    add("--threads", type=int, default=min(4, os.cpu_count() or 1))
    return parser
