"""Generated code: rows a second of one core beside ONNX Runtime, and errors on golden vectors.

    python -m benchmarks.shaders lamp.plux [more.plux] [--browser] [--osl]

Seconds are those of this process's processor time, so that a busy machine counts little.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format import command, members
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_onnx.session import Session
from purelight_shader import write
from purelight_shader.conformance_host import NETWORKS
from purelight_shader.form.store import Store
from purelight_shader.library import Library, build
from purelight_shader.output.vectors import SelfTest, selftest
from purelight_shader.translation import translate
from tests.support import browser, osl_picture

FLAGS = ("-O3", "-march=native")
ROWS, SECONDS = 1 << 10, 1.0
CHUNKS = (1, 512, 1024)
Figures = dict[str, Any]


def main() -> int:
    """Measures every bundle, and prints one line for each network."""
    parser = command.Parser(prog="python -m benchmarks.shaders", description=__doc__)
    parser.add_argument("bundles", type=Path, nargs="+")
    parser.add_argument("--browser", action="store_true", help="WebGL and WebGPU in Chromium")
    parser.add_argument("--osl", action="store_true", help="OSL in Cycles; needs bpy")
    options = parser.parse_args()
    if options.osl and not osl_picture.python():
        raise PureLightError(f"--osl needs a Python with bpy; name one in {osl_picture.VARIABLE}")
    for path in options.bundles:
        _measure(path, options)
    return 0


def _measure(path: Path, options: argparse.Namespace) -> None:
    bundle = Bundle.open(path)
    print(f"{path.stem}")
    with tempfile.TemporaryDirectory() as folder:
        library = build(bundle, Path(folder), FLAGS)
        for line in speeds(bundle, library):
            print("   ", line)
        for language, found in errors(bundle, library, options.browser, options.osl):
            text = ", ".join(f"{name} {error:.3f}" for name, error in found.items())
            print(f"    error in tolerances, {language}: {text}")


def speeds(bundle: Bundle, library: Library) -> Iterator[str]:
    """Rows a second, network by network."""
    head = ["network", "multiply-adds", "C++", *(f"ORT by {n}" for n in CHUNKS)]
    yield "".join(f"{word:>15}" for word in head)
    for network in filter(bundle.manifest.networks.__contains__, NETWORKS):
        vectors = bundle.vectors(network).inputs
        rows = {name: np.resize(a, (ROWS, *a.shape[1:])) for name, a in vectors.items()}
        found = [compiled(library, network, rows)]
        session = Session(bundle.read(members.network(network)), chunk=1024)
        found += [onnx_runtime(session, rows, chunk) for chunk in CHUNKS]
        macs = bundle.manifest.networks[network].macs_per_sample
        yield "".join(f"{x:>15}" for x in (network, f"{macs:,}", *(f"{x:,.0f}" for x in found)))


def compiled(library: Library, network: str, rows: dict[str, np.ndarray]) -> float:
    """Rows a second of the library, which takes one after the other, as a renderer would."""
    name, outputs = NETWORKS[network]
    sizes = [int(np.prod(shape)) for shape in outputs.values()]
    return rate(library.caller(name, list(rows.values()), sizes, ROWS), ROWS)


def onnx_runtime(session: Session, rows: dict[str, np.ndarray], chunk: int) -> float:
    """Rows a second of ONNX Runtime on one thread, a call for each chunk."""
    part = {name: array[:chunk] for name, array in rows.items()}
    return rate(lambda: session(part), chunk)


def rate(call: Callable[[], Any], rows: int) -> float:
    """Rows in a second of processor time, by the best of many calls."""
    end, best = time.process_time() + SECONDS, float("inf")
    while time.process_time() < end:
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return rows / best


def errors(
    bundle: Bundle, library: Library, in_browser: bool, in_cycles: bool
) -> Iterator[tuple[str, dict[str, float]]]:
    """The largest error of each network in units of its golden vectors' tolerances."""
    test = selftest(translate(bundle, Store()))
    yield "C++", test.errors(_answers(bundle, library, test))
    for language in ("webgl", "wgsl") if in_browser else ():
        with tempfile.TemporaryDirectory() as folder:
            write(bundle, language, folder)
            _, result = browser.visit(Path(folder), "selftest.html", seconds=1200)
            yield language, json.loads(result)["errors"]
    if in_cycles:
        yield "osl", _in_cycles(bundle, test)


def _answers(bundle: Bundle, library: Library, test: SelfTest) -> np.ndarray:
    result = np.zeros_like(test.expected)
    for index, network in enumerate(test.networks):
        name, outputs = NETWORKS[network]
        vectors = bundle.vectors(network).inputs
        sizes = [int(np.prod(shape)) for shape in outputs.values()]
        found = np.concatenate(library.ask(name, list(vectors.values()), sizes), 1)
        result[test.inputs[:, 0] == index, : found.shape[1]] = found
    return result


def _in_cycles(bundle: Bundle, test: SelfTest) -> dict[str, float]:
    """The first four numbers of every answer: all but those of the map."""
    answers = test.expected.copy()
    with tempfile.TemporaryDirectory() as folder:
        write(bundle, "osl", folder)
        for first in (0, 1):
            found = osl_picture.answers(Path(folder), first, len(answers))
            answers[:, first : first + 3] = found[:, : answers.shape[1] - first]
    return test.errors(answers)


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.shaders", main))
