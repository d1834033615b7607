"""What the tests of the page in JavaScript read: python -m tests.unit.web.files FOLDER.

`bad/` has the bundles of tests/assets with the reports of `purelight-validate`, `good/` small lamps
with the words of `purelight-inspect`; `networks.json` and `damage.json` have networks and damaged
inputs with Python's verdicts.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from onnx import helper

from purelight_conformance import maker
from purelight_export.export import export
from purelight_format.bundle import Bundle
from purelight_format.members import container
from purelight_format.summary import summary_text
from purelight_format.verdict import figures
from purelight_onnx import web_page
from tests.assets import bad, golden_reports
from tests.support import lamp, untrained
from tests.unit.web import damage, networks

ROOT = Path(__file__).parents[3]
MARKUP = "<img src=x onerror=alert(1)>&lt;b&gt;"
FINISHES = (
    {"name": "shade"}, {"name": "brass", "metalness": 0.9}, {"name": "globe", "opacity": 0.0},
    {"name": "pane", "opacity": 0.0, "thin_walled": True}, {"name": "brass", "metalness": 0.8},
    {"name": "hole", "base_color": [0.0, 0.0, 0.0], "ior": 1.0}, {"name": "cord"},
    {"name": "ring"}, {"name": "hook"},
)  # fmt: skip
LARGE = ("PLX_MEMBER_TOO_LARGE-1", "PLX_NPY_TOO_LARGE-0", "PLX_ONNX_COST-2")  # 17 to 134 MB.


def write(folder: Path, *, large: bool = False) -> None:
    """Writes everything."""
    for name in ("bad", "good", "suite"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    maker.make(folder / "suite")
    expected = {
        "bad": write_bad(folder / "bad", large=large), "good": write_good(folder / "good")
    }  # fmt: skip
    (folder / "expected.json").write_text(json.dumps(expected))
    (folder / "networks.json").write_text(json.dumps(networks.made()))
    (folder / "damage.json").write_text(json.dumps(damage.made()))


def write_bad(folder: Path, *, large: bool) -> dict[str, list[str]]:
    """Every bad bundle of the repository; their reports by name."""
    kept = json.loads(golden_reports.PATH.read_text())
    made = {name: make for name, (make, beside) in golden_reports.MAKERS.items() if not beside}
    kept = {name: kept[name] for name in made if large or name not in LARGE}
    for name in kept:
        data = made[name]()
        with open(folder / f"{name}.plux", "wb") as file:  # The gigabyte of zeros is a hole.
            file.write(data.rstrip(b"\0"))
            file.truncate(len(data))
    return kept


def write_good(folder: Path) -> dict[str, str]:
    """Small lamps; what is said of them by name."""
    lamps = {
        "octahedron": container.pack(lamp.good()),
        "smallest": (ROOT / "spec/example.plux").read_bytes(),
        "globe": (ROOT / "web/examples/Glass_globe.plux").read_bytes(),
        "lantern": (ROOT / "web/examples/Paper_lantern.plux").read_bytes(),
    }
    lamps |= {"markup": bad.edited("name", MARKUP), "large": large_layers()}
    for name, data in lamps.items():
        (folder / f"{name}.plux").write_bytes(data)
    for name, data in judged().items():
        (folder / f"{name}.plux").write_bytes(data)
        lamps[name] = data
    run = untrained.write(folder / "run")
    for name, compact in (("wild", False), ("wild_compact", True)):
        export(run, folder / f"{name}.plux", name=name, compact=compact)
        lamps[name] = b""
    opened = {name: Bundle.open(folder / f"{name}.plux") for name in lamps}
    web_page.write(folder / "own.html", opened["markup"])
    return {name: summary_text(found) for name, found in opened.items()}


TRIED: list[Any] = [[], ["none"], ["none", "straight"], "none", 1, {}]


def judged(count: int = 24) -> dict[str, bytes]:
    """The good lamp with verdicts of every kind, finishes, and a tier of the future."""
    rng = np.random.default_rng(20)
    lamps = {
        "tier": bad.edited("tier", "huge"),
        "finished": bad.finished(*({**bad.FINISH, **each} for each in FINISHES)),
    }
    for k in range(count):
        verdict = asdict(some_verdict(rng))
        made: dict[str, Any] = {"preset": rng.choice(["draft", "standard", "paper", "own"]).item()}
        made["anchor"] = rng.choice(["none", "straight"]).item()
        if rng.random() < 0.5:
            made["tried_anchors"] = TRIED[rng.integers(len(TRIED))]

        def edit(root: dict[str, Any], verdict: Any = verdict, made: Any = made) -> None:
            root["fidelity"]["verdict"] = verdict
            root["provenance"] |= made

        lamps[f"verdict_{k}"] = lamp.seal(lamp.good(), edit)
    return lamps


def some_verdict(rng: np.random.Generator) -> figures.Verdict:
    """Figures from every side of every bar."""

    def part(low: float = 0.004, high: float = 0.8) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    def zones(sign: bool) -> figures.Zones:
        values = [part() * (rng.choice([-1.0, 1.0]) if sign else 1.0) for _ in range(3)]
        return figures.Zones(*map(float, values))

    def mode() -> figures.Mode:
        mean = float(rng.normal(0, 0.02))
        return figures.Mode(part(), part(), mean, float(rng.uniform(-0.1, 1.2)), zones(sign=True))

    seen = figures.Look(1 / 64, float(rng.uniform(-0.1, 1.1)), 0.03, float(rng.normal(0, 0.3)),
                        part(), part())  # fmt: skip
    return figures.Verdict(
        1 << 20, mode(), zones(sign=False), part(), mode() if rng.random() < 0.8 else None,
        figures.Places(part(), part(), 0.01) if rng.random() < 0.5 else None,
        seen if rng.random() < 0.8 else None,
        float(rng.uniform(0, 40)) if rng.random() < 0.7 else None,
        float(rng.normal(0.05, 0.05)) if rng.random() < 0.5 else None,
    )  # fmt: skip


def large_layers() -> bytes:
    """A valid lamp whose appearance has more steps than a shader may: sines of 30,000 columns."""
    width, node = 30_000, helper.make_node

    def change(proto: Any) -> None:
        first, last = proto.graph.node[:-1], proto.graph.node[-1]
        proto.graph.ClearField("node")
        weights = {"wide": np.zeros((3, width)), "narrow": np.ones((width, 3))}
        proto.graph.initializer.extend(networks.tensors(weights))
        made = [
            node("MatMul", ["y", "wide"], ["z0"]),
            node("Sin", ["z0"], ["z1"]),
            node("MatMul", ["z1", "narrow"], ["z2"]),
            node("Add", ["y", "z2"], ["z3"]),
        ]
        last.input[0] = "z3"
        proto.graph.node.extend([*first, *made, last])

    return bad.network(change)


if __name__ == "__main__":
    write(Path(sys.argv[1]), large="--large" in sys.argv)
