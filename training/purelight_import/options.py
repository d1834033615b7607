"""What a person may say about a lamp that is brought in; for `purelight-train` too."""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from purelight_format import command

UNITS_HELP = "m, cm, mm, in, ft or metres as a number (default: the file's)"
GROUP = "lamps of other formats"
AUTO = "auto"  # For --keep.


@dataclass(frozen=True)
class Options:
    """Arguments:
    units, up: unit of length and axis that points up; None is the file's.
    emitters: what emits, `NAME[=AMOUNT[,AMOUNT]]` each; none is what emits by the file.
    lumens: luminous flux of all emitters together.
    kelvin: colour temperature of the emitters.
    omit: patterns of parts to leave out.
    keep: patterns of parts to write into `kept.xml`; `AUTO`, the opaque ones away from the light.
    glass: `NAME=solid` or `NAME=thin` each.
    pieces: patterns of parts to take apart into their unconnected pieces.
    name: of the lamp; None is that of the file's scene, or of the file.
    """

    units: str | None = None
    up: str | None = None
    emitters: tuple[str, ...] = ()
    lumens: float | None = None
    kelvin: float | None = None
    omit: tuple[str, ...] = ()
    keep: tuple[str, ...] = ()
    glass: tuple[str, ...] = ()
    pieces: tuple[str, ...] = ()
    name: str | None = field(default=None)

    @property
    def given(self) -> bool:
        """Whether anything was said."""
        return self != Options()

    def to_dict(self) -> dict[str, Any]:
        """What was said, as a record in JSON gives it back."""
        said = {key: value for key, value in asdict(self).items() if value}
        return {k: list(v) if isinstance(v, tuple) else v for k, v in said.items()}

    @staticmethod
    def of(arguments: argparse.Namespace) -> Options:
        """The options among parsed arguments."""
        values: dict[str, Any] = {f.name: getattr(arguments, f.name) for f in fields(Options)}
        lists = {k: tuple(v) for k, v in values.items() if isinstance(v, list)}
        return Options(**(values | lists))


def add(parser: argparse.ArgumentParser) -> None:
    """Adds the options to a parser."""
    add = parser.add_argument_group(GROUP).add_argument
    add("--units", type=_unit, metavar="UNIT", help=UNITS_HELP)
    add("--up", choices=("x", "y", "z", "-x", "-y", "-z"), help="axis that points up")
    add("--emitter", dest="emitters", type=_emitter, action="append", default=[],
        metavar="NAME[=806lm[,2700K]]",
        help="parts that emit, by name of part, node or material (* and ? fit any letters); "
        "'emissive' is all that emits by the file; may be repeated")  # fmt: skip
    add("--lumens", type=command.number(0), metavar="LM",
        help="luminous flux of all emitters together, before any glass")  # fmt: skip
    add("--kelvin", type=_kelvin, metavar="K", help="colour temperature of the emitters")
    add("--pieces", action="append", default=[], metavar="NAME",
        help="take parts apart into the pieces that do not touch, NAME.1 (the largest), NAME.2, "
        "..., which the other options can name")  # fmt: skip
    add("--omit", action="append", default=[], metavar="NAME", help="leave parts out")
    add("--keep", action="append", default=[], metavar="NAME",
        help="leave dark parts out of the lamp and write them into kept.xml, as geometry of the "
        "room; auto (purelight-train): the opaque ones away from the light")  # fmt: skip
    add("--glass", type=_glass, action="append", default=[], metavar="NAME=solid|thin",
        help="make parts a body of glass that refracts, or a thin sheet")  # fmt: skip
    add("--name", help="name of the lamp (default: that of its scene or file)")


def _unit(text: str) -> str:
    from purelight_import.model.frame import UNITS, unit

    try:
        unit(text)
    except ValueError:
        names = ", ".join(UNITS)
        raise argparse.ArgumentTypeError(f"{text}: give {names} or metres as a number") from None
    return text


def _emitter(text: str) -> str:
    from purelight_import.parts.emitters import parse

    try:
        parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text}: {error}") from None
    return text


def _kelvin(text: str) -> float:
    from purelight_import.parts.emitters import kelvin

    try:
        return kelvin(float(text.rstrip("kK")))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text}: {error}") from None


def _glass(text: str) -> str:
    name, _, kind = text.rpartition("=")
    if not name or kind not in ("solid", "thin"):
        raise argparse.ArgumentTypeError(f"{text}: give NAME=solid or NAME=thin")
    return text
