"""`purelight-validate` and `purelight-inspect`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from purelight_format import atomic, command
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.light_distribution import lamp_photometry, photometry_json, photometry_text
from purelight_format.members import strict_json
from purelight_format.photometry.comparison import Comparison
from purelight_format.photometry.files import is_photometric
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.polar_plot import polar_plot
from purelight_format.photometry.ugr import UgrTable
from purelight_format.ray_file.files import is_ray_file, read_ray_file
from purelight_format.ray_file.summary import ray_summary_json, ray_summary_text
from purelight_format.summary import summary_json, summary_text
from purelight_format.validation.validate import validate


def validate_main(argv: Sequence[str] | None = None) -> int:
    """Checks bundles: 0 if all are valid, 1 if one is not, 2 if one could not be read."""
    name = "purelight-validate"
    parser = _parser(name, "Checks that a .plux bundle is valid.")
    return command.run(name, lambda: _validate(parser.parse_args(argv)))


def inspect_main(argv: Sequence[str] | None = None) -> int:
    """Says what a bundle is: 0, or 2 if it is not valid or could not be read."""
    name = "purelight-inspect"
    parser = _parser(name, "Says what a .plux bundle, a photometric file or a ray file holds.")
    add = parser.add_argument
    add("--compare", type=Path, metavar="FILE", help="its light against an .ies, .ldt or .plux")
    add("--plot", type=Path, metavar="PICTURE.svg", help="polar diagrams, side by side")
    add("--ugr", action="store_true", help="table of unified glare ratings")
    return command.run(name, lambda: _inspect(parser.parse_args(argv)))


def _parser(name: str, description: str) -> command.Parser:
    parser = command.Parser(prog=name, description=description)
    parser.add_argument("bundle", type=Path, help="lamp.plux")
    parser.add_argument("--json", action="store_true", help="for programs")
    return parser


def _validate(options: argparse.Namespace) -> int:
    report = validate(options.bundle)
    path = str(options.bundle)
    print(report.to_json(path) if options.json else report.to_text(path))
    return report.exit_code


def _inspect(options: argparse.Namespace) -> int:
    data, text = _about(options)
    if options.json:
        print(strict_json.shown(data))
    else:
        print(text)
    return 0


def _about(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """What was asked for, for programs and for people."""
    lamps: list[LampPhotometry] = []
    if options.compare or options.plot or options.ugr:
        paths = [options.bundle, *([options.compare] if options.compare else [])]
        lamps = [lamp_photometry(path) for path in paths]
    if options.plot:
        _plot(options.plot, lamps)
    data: dict[str, Any] = {}
    texts = []
    if options.compare:
        comparison = Comparison(*lamps)
        data["comparison"], texts = comparison.to_json(), [comparison.to_text()]
        if not options.plot:
            texts.append("polar diagrams side by side: add --plot PICTURE.svg")
    if options.ugr:
        table = UgrTable.of(lamps[0])
        data["ugr"] = table.to_json()
        texts.append(table.to_text())
    return (data, "\n\n".join(texts)) if data else _whole(options.bundle)


def _whole(path: Path) -> tuple[dict[str, Any], str]:
    if is_ray_file(path):
        file = read_ray_file(path)
        return ray_summary_json(file), ray_summary_text(file)
    if is_photometric(path):
        lamp = lamp_photometry(path)
        return photometry_json(lamp), photometry_text(lamp)
    bundle = Bundle.open(path)
    return summary_json(bundle), summary_text(bundle)


def _plot(path: Path, lamps: Sequence[LampPhotometry]) -> None:
    if path.suffix.lower() != ".svg":
        raise PureLightError(f"{path}: the picture's name must end in .svg")
    atomic.check_file(path)
    atomic.write_bytes(path, polar_plot(lamps).encode())
