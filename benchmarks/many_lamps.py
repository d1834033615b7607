"""Thousands of references of one lamp: processor seconds until they are found, and loaded.

python -m benchmarks.many_lamps lamp.usda [--count 2000]

The asset is referenced by as many prims, by as many instanceable ones, and by one PointInstancer;
`purelight_format.usd.luminaires` finds them in the open stage, `load_usd` makes a scene of them.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pxr import Usd

from purelight_format import command
from purelight_format.errors import PureLightError
from purelight_format.usd.luminaires import luminaires
from purelight_mitsuba import platform

HEAD = '#usda 1.0\n(\n    defaultPrim = "Hall"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
CAMERA = """def Camera "Camera"
{
    double3 xformOp:translate = (0, 0, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
REFERENCE = """    def Xform "Lamp_{index}" ({instanceable}
        references = @{asset}@
    )
    {{
        double3 xformOp:translate = ({x}, {y}, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
"""
SCATTER = """    def PointInstancer "Lamps"
    {{
        rel prototypes = [</Hall/Lamps/Lamp>]
        int[] protoIndices = {indices}
        point3f[] positions = {positions}
        def "Lamp" (references = @{asset}@)
        {{
        }}
    }}
"""
KINDS = ("references", "instanceable references", "PointInstancer")
Answer = TypeVar("Answer")


def stage_text(kind: str, asset: Path, count: int) -> str:
    """A hall with lamps, 50 to a row."""
    places = [(k % 50, k // 50) for k in range(count)]
    if kind == "PointInstancer":
        positions = [(x, y, 3) for x, y in places]
        body = SCATTER.format(asset=asset, indices=[0] * count, positions=positions)
    else:
        mark = "\n        instanceable = true" if kind != "references" else ""
        body = "".join(
            REFERENCE.format(index=k, asset=asset, x=x, y=y, instanceable=mark)
            for k, (x, y) in enumerate(places)
        )
    return HEAD + 'def Xform "Hall"\n{\n' + body + "}\n" + CAMERA


def seconds(work: Callable[[], Answer]) -> tuple[float, Answer]:
    """Of the processor, all threads, and what came out."""
    start = time.process_time()
    answer = work()
    return time.process_time() - start, answer


def row(kind: str, asset: Path, count: int, folder: Path) -> str:
    """One line of the table.

    Raises:
        PureLightError: not all lamps were found.
    """
    from purelight_mitsuba.usd_scene import load_usd

    path = folder / f"{kind.split()[0]}.usda"
    path.write_text(stage_text(kind, asset, count))
    stage: Any = Usd.Stage.Open(str(path))
    finding, found = seconds(lambda: luminaires(stage))
    if len(found) != count:
        raise PureLightError(f"{kind}: {len(found)} of {count} lamps were found")
    loading, _ = seconds(lambda: load_usd(path))
    return f"| {kind} | {finding:.2f} | {loading:.2f} |"


def main() -> int:
    """Print the table."""
    parser = command.Parser(prog="python -m benchmarks.many_lamps", description=__doc__)
    parser.add_argument("asset", type=Path, help="of purelight-export, beside its bundle")
    parser.add_argument("--count", type=command.whole(1), default=2000)
    options = parser.parse_args()
    platform.use()
    if not options.asset.is_file():
        raise PureLightError(f"{options.asset}: no such file; purelight-export writes it")
    with tempfile.TemporaryDirectory() as folder:
        print("| lamps as | s to find | s to load |\n|---|---|---|")
        for kind in KINDS:
            print(row(kind, options.asset.resolve(), options.count, Path(folder)), flush=True)
    sys.stdout.flush()
    os._exit(0)  # Scenes of thousands of lamps take long to be freed


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.many_lamps", main))
