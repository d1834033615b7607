"""Routes to the student: error against seconds.

python -m benchmarks.routes --output out/bench/routes [--lamps frosted_globe filament_bulb]
    [--variants photons-straight ...] [--preset draft] [--size 128] [--paths 33554432] [--threads 1]

Each variant trains a student from a lamp's scene alone. Seconds are of the processor, all
that led to the student included, so that a busy machine changes little. Figures of earlier calls
stay in OUTPUT/routes.json; a variant that is in it is not run again, only compared again where the
truth asked for is another.
"""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from purelight_examples.luminaires.catalog import CATALOG
from purelight_format import atomic, command
from purelight_mitsuba import platform
from purelight_train.presets import DRAFT, PRESETS, Preset
from purelight_train.threads import use

if TYPE_CHECKING:  # Mitsuba's variant must be set before it is imported
    from purelight_train.light.radiance_field import Radiance
    from purelight_train.runs.pipeline import Training

SIZE, PATHS, SPP = 128, 32 << 20, 16
TRUTH = ("size", "paths")
Figures = dict[str, Any]


@dataclass(frozen=True)
class Variant:
    """A route, the anchors that its student encodes, and what differs from the preset.

    Arguments:
        changes: fields of the preset.
        steps: factor on those of the student.
    """

    route: str
    anchor: str
    changes: dict[str, Any] = field(default_factory=dict)
    steps: float = 1.0

    def preset(self, base: Preset) -> Preset:
        """The base with the changes."""
        photons = replace(base.photons, steps=round(self.steps * base.photons.steps))
        return replace(base, photons=photons, **self.changes)


ANCHORED = {
    f"{route}-{anchor}": Variant(route, anchor)
    for route in ("teacher", "photons")
    for anchor in ("none", "straight", "refracted", "both")
}
VARIANTS = ANCHORED | {
    "photons-third": Variant("photons", "straight", steps=1 / 3),
    "photons-triple": Variant("photons", "straight", steps=3),
    "photons-poisson": Variant("photons", "straight", {"photon_loss": "poisson"}),
    "photons-logistic": Variant("photons", "straight", {"photon_loss": "logistic"}),
    "photons-ratio-0.1": Variant("photons", "straight", {"reference_ratio": 0.1}),
    "photons-unlifted": Variant("photons", "none", {"lift": 0.0}),
    "photons-uniform": Variant("photons", "straight", {"reference_light": 0.0}),
}


@dataclass(frozen=True)
class Bench:
    """One lamp's scene, its pictures, and where runs go.

    Arguments:
        preset: of the runs.
        size: pixels along each side of the truth.
        paths: of the truth.
    """

    lamp: str
    output: Path
    preset: Preset = DRAFT
    size: int = SIZE
    paths: int = PATHS

    @property
    def scene(self) -> Path:
        path = self.output / "lamps" / f"{self.lamp}.xml"
        if not path.is_file():
            CATALOG[self.lamp].lamp.write(path.parent)
        return path

    def references(self, training: Any) -> list[tuple[Any, Any]]:
        """Three thin lenses and the light-traced pictures through them, kept on disk."""
        from purelight_train.truth.light_traced import light_traced
        from purelight_train.truth.picture import Picture
        from purelight_train.truth.thin_lens import ThinLens
        from purelight_train.truth.views import three_views

        lenses = three_views(ThinLens(training.lamp.surface.sphere, self.size, 0, 0))
        file = self.output / f"{self.lamp}-{self.size}-{self.paths}.npz"
        if not file.is_file():
            pictures = light_traced(training.lamp.luminaire.scene, lenses, self.paths, seed=7)
            stack = [np.stack((p.image, *p.halves, p.error)) for p in pictures]
            with atomic.replace_file(file) as stream:
                np.savez(stream, pictures=np.stack(stack))
        stored = np.load(file)["pictures"]
        return [(lens, Picture(p[0], (p[1], p[2]), p[3])) for lens, p in zip(lenses, stored)]  # noqa: B905

    def run(self, name: str, threads: int) -> Figures:
        """Train one variant and compare it with the truth."""
        shutil.rmtree(self._folder(name), ignore_errors=True)
        use(threads)
        before, begin = time.process_time(), time.monotonic()
        training = self._training(name)
        training.lamp.store()
        size = sum(p.numel() for p in training.student.parameters())
        seconds = {"cpu": time.process_time() - before, "wall": time.monotonic() - begin}
        return {"seconds": seconds, "parameters": size} | self.compare(training)

    def judge(self, name: str) -> Figures:
        """Compare a variant trained earlier with the truth."""
        return self.compare(self._training(name))

    def _training(self, name: str) -> Training:
        """A variant's run, as far as it is finished."""
        from purelight_train.runs.pipeline import start

        variant, folder = VARIANTS[name], self._folder(name)
        return start(
            self.scene, folder, variant.preset(self.preset), 0, "cpu", resume=folder.exists(),
            route=variant.route, anchor=variant.anchor,
        )  # fmt: skip

    def _folder(self, name: str) -> Path:
        return self.output / f"{self.lamp}-{self.preset.name}-{name}"

    def compare(self, training: Training) -> Figures:
        """Errors of a run's student, and against which truth."""
        import torch

        from purelight_train.runs.evaluation import as_function

        radiance = as_function(training.student, torch.device("cpu"))
        return {"size": self.size, "paths": self.paths} | self.errors(training, radiance)

    def errors(self, training: Any, radiance: Radiance, spp: int = SPP) -> Figures:
        """Held-out likelihood, and image errors as means over three views."""
        from purelight_train.runs.evaluation import fidelity
        from purelight_train.truth.metrics import Comparison
        from purelight_train.truth.views import field_view

        rng, surface = np.random.default_rng(5), training.lamp.surface
        figures: Figures = fidelity(radiance, training.lamp, rng)
        views = []
        for lens, reference in self.references(training):
            picture, mask = field_view(surface, radiance, lens, spp, rng)
            views.append(Comparison(picture, reference, mask).to_dict())
        return figures | {k: float(np.mean([view[k] for view in views])) for k in views[0]}


def table(results: dict[str, Figures]) -> str:
    """The figures as Markdown, quickest first."""
    lines = [
        "| lamp | preset, variant | CPU s | nats | MAPE | (noise) | without noise | relMSE "
        "| HDR-FLIP |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for key, row in sorted(results.items(), key=_order):
        lamp, name = key.split(" ", 1)
        lines.append(
            f"| {lamp} | {name} | {row['seconds']['cpu']:.0f} | {row['held_out_gain_nats']:.3f} "
            f"| {row['mape']:.3f} | {row['mape_of_reference']:.3f} "
            f"| {row['mape_without_noise']:.3f} | {row['relative_mse_without_noise']:.3f} "
            f"| {row['hdr_flip']:.3f} |"
        )
    return "\n".join(lines)


def _order(item: tuple[str, Figures]) -> tuple[str, float]:
    return item[0].split(" ")[0], item[1]["seconds"]["cpu"]


def measure(benches: Iterable[Bench], variants: Sequence[str], threads: int) -> None:
    """Run what routes.json does not hold yet, compare what another truth was used for; print."""
    for bench in benches:
        report = bench.output / "routes.json"
        results: dict[str, Figures] = json.loads(report.read_text()) if report.is_file() else {}
        for name in variants:
            key = f"{bench.lamp} {bench.preset.name}, {name}"
            if key not in results:
                results[key] = bench.run(name, threads)
            elif [results[key].get(k) for k in TRUTH] != [bench.size, bench.paths]:
                results[key] |= bench.judge(name)
            atomic.write_bytes(report, (json.dumps(results, indent=2) + "\n").encode())
    print(table(results))


def main() -> int:
    """Measure; returns 0."""
    parser = command.Parser(prog="python -m benchmarks.routes", description=__doc__)
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/bench/routes"))
    add("--lamps", nargs="+", choices=CATALOG, default=["frosted_globe", "filament_bulb"])
    add("--variants", nargs="+", choices=VARIANTS, default=list(ANCHORED))
    add("--preset", choices=("sketch", "draft", "standard"), default="draft")
    add("--size", type=command.whole(1), default=SIZE, help="pixels of the truth, a side")
    add("--paths", type=command.whole(1), default=PATHS, help="of the truth")
    add("--threads", type=command.whole(1), default=1)
    arguments = parser.parse_args()
    platform.use()
    arguments.output.mkdir(parents=True, exist_ok=True)
    benches = [
        Bench(lamp, arguments.output, PRESETS[arguments.preset], arguments.size, arguments.paths)
        for lamp in arguments.lamps
    ]
    measure(benches, arguments.variants, arguments.threads)
    return 0


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.routes", main))
