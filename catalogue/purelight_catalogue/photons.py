"""Light of one lamp in many tasks: each traces a part, and a last one joins them.

    python -m purelight_catalogue.photons trace FILE --run RUN --paths N --seed S --output part.npz
    python -m purelight_catalogue.photons join part.npz ... --name LAMP --output FOLDER

What a part keeps is sums, whatever the number of its photons: the flux, the far field, and a
picture through a thin lens, with their squares over batches. So 10^9 photons and more take no more
memory than one batch, and parts may be traced anywhere, in any order.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from purelight_catalogue.streams import Streams, joined
from purelight_format import atomic, command
from purelight_format.color import lumens

COMMAND = "photons"
SIZE = 128  # pixels along each side
STREAM = 1 << 16  # seeds of a part's batches are apart from all others'


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one of the two."""
    options = _parser().parse_args(argv)
    return command.run(COMMAND, lambda: options.action(options))


def _trace(options: argparse.Namespace) -> int:
    from purelight_mitsuba import platform
    from purelight_train import threads

    threads.use(options.threads)
    platform.use()
    threads.use_for_tracing(options.threads)
    scene = scene_of(options.run, options.file) if options.run else options.file
    traced(scene, options.paths, options.seed).write(options.output)
    return 0


def scene_of(run: Path, file: Path) -> Path:
    """The scene that a run was trained on: its import of a lamp's file, or the file itself.

    The run may lie elsewhere than when it was made.
    """
    from purelight_train.foreign import FOLDER
    from purelight_train.runs.run_directory import RunDirectory

    named = PurePath(RunDirectory.open(run).config["luminaire"])
    imported = run / FOLDER / named.name
    return imported if named.parent.name == FOLDER and imported.is_file() else file


def traced(scene: Path, paths: int, seed: int) -> Streams:
    """Light of a lamp's scene, rounded up to whole batches."""
    from purelight_export.photometry import intensity
    from purelight_train.light.light_tracing import BATCH, trace_records
    from purelight_train.light.luminaire import load_luminaire
    from purelight_train.truth.light_traced import light_traced, sharp_share
    from purelight_train.truth.thin_lens import ThinLens, aperture_for

    lamp = load_luminaire(scene)
    sphere = lamp.exit_surface.sphere
    lens = ThinLens(sphere, SIZE, 30.0, 10.0, aperture_for(sharp_share(lamp.scene)))
    streams = Streams()
    for batch in range(-(-paths // BATCH)):
        own = (seed * STREAM + batch) & 0x7FFFFFFF
        records = trace_records(lamp.scene, BATCH, own)
        out = records.take(records.escaped)
        table = intensity(out.direction, out.weight, tuple(records.flux))
        picture = light_traced(lamp.scene, [lens], BATCH, own)[0]
        streams.add(BATCH, {"flux": records.flux, "far_field": table.values,
                            "picture": picture.image})  # fmt: skip
    return streams


def _join(options: argparse.Namespace) -> int:
    from purelight_export.export import power
    from purelight_export.photometry import Intensity, ies_file
    from purelight_format.srgb import png
    from purelight_train.runs.run_directory import RunDirectory

    whole = joined(options.parts)
    if options.lumens:
        whole = whole.scaled(power(RunDirectory.open(options.run), options.lumens))
    values = whole.mean("far_field")
    vertical, horizontal = (np.linspace(0, end, n) for end, n in
                            ((180, values.shape[1]), (360, values.shape[0])))  # fmt: skip
    table = Intensity(vertical, horizontal, values)
    figures = _figures(whole)
    files = {
        f"{options.name}.photons.json": (json.dumps(figures, indent=1) + "\n").encode(),
        f"{options.name}.photons.ies": ies_file(
            table, name=options.name, issued=options.issued, radius=0.0
        ),
        "truth.png": png(whole.mean("picture").astype(np.float32), None),
    }
    for name, data in files.items():
        atomic.write_bytes(options.output / name, data)
    return 0


def _figures(whole: Streams) -> dict[str, Any]:
    flux, error = whole.mean("flux"), whole.error("flux")
    picture, noise = whole.mean("picture"), whole.error("picture")
    lit = picture > 0.01 * picture.mean()
    return {
        "paths": whole.paths,
        "flux": flux.tolist(),
        "flux_error": error.tolist(),
        "lumens": lumens(flux),
        "lumens_error": lumens(error),
        "far_field_noise": float(whole.error("far_field").mean() / whole.mean("far_field").mean()),
        "picture_noise": float(noise[lit].mean() / picture[lit].mean()),
    }


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    kinds = parser.add_subparsers(required=True, parser_class=command.Parser)
    trace = kinds.add_parser("trace", help="trace a part")
    trace.add_argument("file", type=Path, help="the lamp")
    trace.add_argument("--run", type=Path, help="its training, which may have made its scene")
    trace.add_argument("--paths", type=int, required=True)
    trace.add_argument("--seed", type=int, required=True)
    trace.add_argument("--threads", type=int, default=1)
    trace.add_argument("--output", type=Path, required=True)
    trace.set_defaults(action=_trace)
    join = kinds.add_parser("join", help="join the parts")
    join.add_argument("parts", type=Path, nargs="+")
    join.add_argument("--name", required=True)
    join.add_argument("--lumens", type=float, help="to scale the light to, as an export of --run")
    join.add_argument("--run", type=Path, help="the lamp's training")
    join.add_argument("--issued", required=True, help="date in the IES file, YYYY-MM-DD")
    join.add_argument("--output", type=Path, required=True)
    join.set_defaults(action=_join)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
