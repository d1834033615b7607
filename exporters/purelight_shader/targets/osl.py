"""A lamp as a shader of OSL, with its large tables in a texture, and the shader that tests it."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from string import Template

import numpy as np

from purelight_format.errors import PureLightError
from purelight_shader.form.elements import Kind
from purelight_shader.form.statements import Program
from purelight_shader.form.store import FOUR, Store
from purelight_shader.pages import page
from purelight_shader.printing.osl import FUNCTIONS, OslPrinter, number
from purelight_shader.printing.printer import called
from purelight_shader.translation import Translation, function

WRITTEN, ROOM = 1 << 14, 1 << 16  # Elements of a constant, and of all, that stand in the code.
WIDTH, MOST_ROWS = 1024, 1 << 14  # Of the texture, in texels.
TABLES = "tables.exr"
# The shader is called by the prefix alone, which must be none of these.
WORDS = frozenset(re.findall(r"\w+", """
    and bool break case catch char class closure color const continue default delete displacement do
    double else emit enum extern false float for friend goto if illuminance illuminate inline int
    light long matrix new normal not operator or output point private protected public return
    selftest shader short signed sizeof static string struct surface switch template this throw true
    try typedef uniform union unsigned varying vector virtual void volatile volume while
"""))  # fmt: skip
TRANSMITTANCE = """\
    ${prefix}_transmittance(Tables, place, side, leaving, found);
    Transmittance = color(found[0], found[1], found[2]);"""


def store() -> Store:
    """Takes a lamp's constants: what is read in fours may stand in the code too."""
    return Store(WRITTEN, room=ROOM, fours=False)


def files(
    translation: Translation, prefix: str, head: str, asked: np.ndarray
) -> tuple[dict[str, str], int]:
    """The shaders by name, and the numbers in the arrays of the largest function.

    Arguments:
        asked: rows of the self-test's inputs.
    """
    programs = translation.programs
    text, elements = functions(translation, prefix)
    known = {"head": head, "functions": text, "prefix": prefix}
    through = Template(TRANSMITTANCE).substitute(known) if "transparency" in programs else ""
    lamp = Template(page("lamp.osl.in")).substitute(known, transmittance=through)
    test = Template(page("selftest.osl.in")).substitute(
        known, **_test(programs, _names(programs, prefix), asked)
    )
    return {"lamp.osl": lamp, "selftest.osl": test}, elements


def functions(translation: Translation, prefix: str) -> tuple[str, int]:
    """Every network as a function with what they call; numbers in the arrays of the largest."""
    names = _names(translation.programs, prefix)
    printers = [OslPrinter(p, names[n], prefix) for n, p in translation.programs.items()]
    texts = [printer.text() for printer in printers]
    text = _support(texts, prefix, translation.store) + "\n" + "\n".join(texts)
    return text, max(printer.plan.elements for printer in printers)


def _names(programs: dict[str, Program], prefix: str) -> dict[str, str]:
    return {network: f"{prefix}_{function(network)}" for network in programs}


def _support(texts: list[str], prefix: str, held: Store) -> str:
    needed = called("\n".join(texts), prefix, FUNCTIONS)
    joined = "\n".join(text for name, text in FUNCTIONS.items() if name in needed)
    sized = joined.replace("$WIDTH$", str(WIDTH)).replace("$ROWS$", str(_rows(held)))
    return sized.replace("@", prefix) + "\n"


def _rows(held: Store) -> int:
    return max(1, -(-held.size(Kind.FLOAT) // (FOUR * WIDTH)))


def _test(programs: dict[str, Program], names: dict[str, str], asked: np.ndarray) -> dict[str, str]:
    room = max(sum(port.array.size for port in p.outputs) for p in programs.values())
    rows, inputs = asked.shape
    cases = [_case(k, names[n], program) for k, (n, program) in enumerate(programs.items())]
    return {
        "rows": str(rows), "inputs": str(inputs), "asked": str(asked.size),
        "values": ", ".join(number(Kind.FLOAT, value) for value in asked.ravel().tolist()),
        "room": str(room + 2), "cases": "\n".join(line for case in cases for line in case),
    }  # fmt: skip


def _case(index: int, name: str, program: Program) -> Iterator[str]:
    """Asks one network: its inputs and outputs are arrays of their own."""
    yield f"    if (network == {index}) {{"
    place = 1
    arguments = ["Tables"]
    for port in program.inputs:
        values = ", ".join(f"x[{place + k}]" for k in range(port.array.size))
        yield f"        float {port.array.name}[{port.array.size}] = {{ {values} }};"
        arguments.append(port.array.name)
        place += port.array.size
    for port in program.outputs:
        yield f"        float {port.array.name}[{port.array.size}];"
        arguments.append(port.array.name)
    yield f"        {name}({', '.join(arguments)});"
    place = 0
    for port in program.outputs:
        start = f"{place} + k" if place else "k"
        yield f"        for (int k = 0; k < {port.array.size}; k += 1) {{"
        yield f"            y[{start}] = {port.array.name}[k];"
        yield "        }"
        place += port.array.size
    yield "    }"


def tables(held: Store) -> dict[str, bytes]:
    """The texture of `texels` as a file; maybe none.

    Raises:
        PureLightError: If a texture cannot hold it.
    """
    found = texels(held)
    return {} if found is None else {TABLES: _exr(found)}


def texels(held: Store) -> np.ndarray | None:
    """What does not stand in the code: [rows, width, 4] float32, or None if all does.

    Raises:
        PureLightError: If a texture cannot hold it.
    """
    if held.size(Kind.INT):
        raise PureLightError(
            "OSL cannot read tables that purelight-export --precision compact has packed; "
            "export the run with --precision fp32"
        )
    if not held.size(Kind.FLOAT):
        return None
    rows = _rows(held)
    if rows > MOST_ROWS:
        raise PureLightError(
            f"the networks' tables take {rows:,} rows of a texture, at most {MOST_ROWS:,} are "
            "written; train a smaller lamp (purelight-size)"
        )
    fours = held.buffer(Kind.FLOAT)
    padded = np.pad(fours, ((0, rows * WIDTH - len(fours)), (0, 0)))
    return padded.reshape(rows, WIDTH, FOUR).astype(np.float32)


def _exr(pixels: np.ndarray) -> bytes:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / TABLES
        with OpenEXR.File(header, {"RGBA": pixels}) as file:
            file.write(str(path))
        return path.read_bytes()
