"""Lamps in other light against path tracing of the real ones, with finishes and without.

python -m benchmarks.finishes --runs FOLDER [--lamps shade metal ...] [--output out/finishes]
    [--size 96] [--spp 256] [--truth-spp 1024] [--states off on] [--rooms window sky beside]
    [--truth ptracer]

FOLDER holds a run directory of `purelight-train` for each lamp of `benchmarks.finished_lamps`
(`--scenes FOLDER` writes their scenes, to be trained). Each lamp stands on a table in a room with
a window, and under an even sky, switched off and on; `beside` is a dark room with nothing but a
second lamp of the same kind beside it, which is on. Parts that a run has kept out of its networks
stand there as geometry. For each part of the lamp that the camera sees first, the table has its
radiance over the truth without and with finishes, and the noise of that; then there are a white
furnace, seconds, and the bytes that finishes add. Pictures: without, with, truth. The truth is
path traced, or light traced (`--truth ptracer`), which sees no polished parts: those are left out.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from benchmarks import finished_lamps
from benchmarks.zoo.lamps.plugin import scale_bumps
from purelight_format import atomic, command
from purelight_format.bundle import Bundle
from purelight_mitsuba import platform
from purelight_mitsuba.scene_file import load_scene

UNIT = 100.0  # Radius of the lamps' spheres; large, as Mitsuba lifts rays by at least 9e-5.
PASSES = 8
ROOM = 8.0  # Half the width of the room, in radii.
CAMERA, FIELD = (2.6, -2.4, 0.9), 36.0
MIDDLE, BESIDE = (0.0, 0.0, 0.0), (2.1, 1.2, 0.0)  # Of lamps, in radii; the second is not seen.
UNKNOWN = 0.25  # Noise of a part that tells nothing.
ROOMS, STATES = ("window", "sky", "beside"), ("off", "on")
HOSTS = (("accurate", "fused"), ("accurate", "queued"), ("fast", "fused"), ("fast", "queued"))
Figures = dict[str, Any]
Place = tuple[float, float, float]


@dataclass(frozen=True)
class Subject:
    """One lamp.

    Arguments:
        scene, dark: Its real scene, and the same without emitters.
        bundle: Of its networks.
    """

    name: str
    scene: Path
    dark: Path
    bundle: Path

    @property
    def tracer(self) -> dict[str, Any]:
        """The path tracer for its real scene."""
        kind = "volpath" if "<medium" in self.scene.read_text() else "path"
        return {"type": kind, "max_depth": -1 if kind == "path" else 256, "rr_depth": 16}

    def placed(self, at: Place = MIDDLE) -> Any:
        """The transform that gives its bounding sphere the radius `UNIT`."""
        import mitsuba as mi

        sphere = Bundle.open(self.bundle, validate=False).manifest.bounding_sphere
        move, away = [UNIT * c for c in at], [-c for c in sphere.center]
        transform = mi.ScalarTransform4f
        return transform().translate(move).scale(UNIT / sphere.radius).translate(away)

    def neural(self, *, on: bool, finishes: bool, at: Place = MIDDLE) -> dict[str, Any]:
        """The bundle as an emitter, and the parts that were kept out of it."""
        lamp = {
            "type": "purelight", "filename": str(self.bundle), "to_world": self.placed(at),
            "dimmer": float(on), "finishes": finishes,
        }  # fmt: skip
        kept = self.bundle.with_suffix(".kept.xml")
        parts = self._shapes(kept, at) if kept.is_file() else {}
        return {_key("lamp", at): lamp} | parts

    def real(self, *, on: bool, at: Place = MIDDLE) -> dict[str, Any]:
        """The shapes of the real lamp, by their names."""
        return self._shapes(self.scene if on else self.dark, at)

    def _shapes(self, path: Path, at: Place) -> dict[str, Any]:
        matrix = " ".join(f"{x:.9g}" for x in np.array(self.placed(at).matrix).ravel())
        root = ET.parse(path).getroot()
        for shape in root.iter("shape"):
            place = shape.find("transform[@name='to_world']")
            if place is None:
                place = ET.SubElement(shape, "transform", name="to_world")
            ET.SubElement(place, "matrix", value=matrix)
        for name in root.findall(".//string[@name='filename']"):
            name.set("value", str((path.parent / name.attrib["value"]).resolve()))
        larger = UNIT / Bundle.open(self.bundle, validate=False).manifest.bounding_sphere.radius
        for medium in root.iter("medium"):  # As much in it as before.
            given = medium.find("float[@name='scale']")
            given = ET.SubElement(medium, "float", name="scale") if given is None else given
            given.set("value", f"{float(given.get('value', 1)) / larger:.9g}")
        scale_bumps(root, larger)
        moved = path.with_name(f"{path.stem}_placed.xml")
        atomic.write_bytes(moved, ET.tostring(root))
        scene = load_scene(moved, optimize=False)
        return {_key(f"part_{shape.id()}", at): shape for shape in scene.shapes()}


def _key(name: str, at: Place) -> str:
    """Of an object of a scene."""
    return name if at == MIDDLE else f"{name}_beside"


def surroundings(room: str, size: int) -> dict[str, Any]:
    """The scene without the lamp."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    eye = [UNIT * x for x in CAMERA]
    look = transform().look_at(eye, [0, 0, 0], [0, 0, 1])
    scene: dict[str, Any] = {
        "type": "scene",
        "sensor": {"type": "perspective", "fov": FIELD, "film": film, "to_world": look},
    }
    if room == "furnace":
        return scene | _sky((1.0, 1.0, 1.0))
    table = {
        "type": "rectangle", "to_world": transform().scale(UNIT).translate([0, 0, -1.05]).scale(3),
        "bsdf": _matt(0.3, 0.25, 0.2),
    }  # fmt: skip
    if room == "sky":
        return scene | _sky((0.8, 0.9, 1.0)) | {"table": table}
    if room == "beside":
        return scene | {"table": table}
    wall = _matt(0.6, 0.58, 0.5)
    cube = {"type": "cube", "flip_normals": True, "to_world": transform().scale(ROOM * UNIT)}
    at = transform().scale(UNIT).translate([ROOM - 0.05, -3, 3]).rotate([0, 1, 0], -90).scale(2.5)
    glow = {"type": "area", "radiance": {"type": "rgb", "value": [9.0, 10.0, 11.0]}}
    window = {"type": "rectangle", "to_world": at, "emitter": glow, "bsdf": _matt(0, 0, 0)}
    return scene | {"table": table, "walls": cube | {"bsdf": wall}, "window": window}


def _matt(*color: float) -> dict[str, Any]:
    rgb = {"type": "rgb", "value": list(color)}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb}}


def _sky(color: tuple[float, ...]) -> dict[str, Any]:
    """Even light, and specks that tell Mitsuba how large the scene is."""
    import mitsuba as mi

    specks = {
        f"speck{k}": {
            "type": "cube", "to_world": mi.ScalarTransform4f().translate([k * UNIT] * 3).scale(1e-2)
        }
        for k in (-9, 9)
    }  # fmt: skip
    return specks | {"sky": {"type": "constant", "radiance": {"type": "rgb", "value": list(color)}}}


@dataclass(frozen=True)
class Rendered:
    """Passes [P, H, W, 3], and seconds without compilation."""

    passes: np.ndarray
    seconds: float

    @property
    def image(self) -> np.ndarray:
        mean: np.ndarray = self.passes.mean(0)
        return mean

    def mean(self, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean radiance [3] over pixels, and its standard error."""
        each = self.passes[:, mask].mean(1)
        return each.mean(0), each.std(0, ddof=1) / np.sqrt(len(each))


def render(scene: dict[str, Any], integrator: dict[str, Any], spp: int) -> Rendered:
    """Renders in independent passes."""
    import mitsuba as mi

    loaded, made = mi.load_dict(scene), mi.load_dict(integrator)
    mi.render(loaded, integrator=made, spp=1)
    start, passes = time.perf_counter(), []
    for index in range(PASSES):
        image = mi.render(loaded, integrator=made, spp=max(spp // PASSES, 1), seed=index + 1)
        passes.append(np.array(image, np.float64)[..., :3])
    return Rendered(np.array(passes), time.perf_counter() - start)


def regions(subject: Subject, size: int) -> dict[str, np.ndarray]:
    """Pixels whose middle sees a part of the real lamp first, by the part's name."""
    import mitsuba as mi

    scene = mi.load_dict(surroundings("furnace", size) | subject.real(on=False))
    grid = (np.stack(np.meshgrid(*2 * [np.arange(size)]), -1).reshape(-1, 2) + 0.5) / size
    point = mi.Point2f(np.ascontiguousarray(grid.T, np.float32))
    ray, _ = scene.sensors()[0].sample_ray(0, 0.5, point, 0.5)
    si = scene.ray_intersect(ray)
    valid = np.array(si.is_valid())
    names = np.array([shape.id() if shape is not None else "" for shape in si.shape])
    found = {name: (names == name) & valid for name in dict.fromkeys(names[valid])}
    masks = {name: mask.reshape(size, size) for name, mask in found.items() if mask.sum() > 9}
    return {name: mask for name, mask in masks.items() if not name.startswith("speck")}


def measure(subject: Subject, room: str, *, on: bool, options: argparse.Namespace) -> Figures:
    """Radiance over the truth, part by part, and a picture of all three."""
    room_itself = surroundings(room, options.size)
    masks = regions(subject, options.size)
    beside = room == "beside"
    real, lamps = subject.real(on=on), []
    for finishes in (False, True):
        lamps.append(subject.neural(on=on, finishes=finishes))
        if beside:
            lamps[-1] |= subject.neural(on=True, finishes=finishes, at=BESIDE)
    if beside:
        real |= subject.real(on=True, at=BESIDE)
    tracer = {"type": "ptracer", "rr_depth": 16} if options.truth == "ptracer" else subject.tracer
    truth = render(room_itself | real, tracer, options.truth_spp)
    ours = {"type": "purelight", "mode": options.mode}
    before, after = (render(room_itself | lamp, ours, options.spp) for lamp in lamps)
    name = f"{subject.name}-{room}-{'on' if on else 'off'}"
    _picture(options.output / f"{name}.png", [p.image for p in (before, after, truth)])
    masks["lamp"] = np.any(list(masks.values()), axis=0)
    result: Figures = {"seconds": [p.seconds for p in (before, after, truth)], "parts": {}}
    for part, mask in masks.items():
        right, error = truth.mean(mask)
        sides = [p.mean(mask)[0] for p in (before, after)]
        own = after.mean(mask)[1]
        noise = float((np.hypot(error, own) / np.maximum(right, 1e-30)).mean())
        if noise > UNKNOWN:  # A light tracer finds hardly anything in a mirror.
            continue
        result["parts"][part] = {
            "pixels": int(mask.sum()),
            "truth": right.tolist(),
            "noise": noise,
            "before": float(sides[0].sum() / right.sum()),
            "after": float(sides[1].sum() / right.sum()),
        }
    return result


def furnace(subject: Subject, options: argparse.Namespace) -> Figures:
    """The mean over the lamp in an even sky of radiance 1, and whether anything is above 1."""
    scene = surroundings("furnace", options.size) | subject.neural(on=False, finishes=True)
    masks = regions(subject, options.size)
    mask = np.any(list(masks.values()), axis=0)
    real = surroundings("furnace", options.size) | subject.real(on=False)
    truth = render(real, subject.tracer, options.spp)
    result: Figures = {"truth": float(truth.image[mask].mean())}
    for mode, engine in HOSTS:
        ours = {"type": "purelight", "mode": mode, "engine": engine, "rr_depth": 1000}
        found = render(scene, ours, options.spp)
        result[f"{mode}, {engine}"] = {
            "mean": float(found.image[mask].mean()),
            "brightest": float(found.image.max()),
            "p": _chance(found.passes[:, mask]),
        }
    return result


def _chance(passes: np.ndarray) -> float:
    """The chance of pixels [passes, N, 3] as far above 1 as these, if they are 1 in truth.

    The error of a pixel is at least the median of all: passes are few, and their spread by chance
    may be small.
    """
    mean, error = passes.mean(0), passes.std(0, ddof=1) / np.sqrt(len(passes))
    score = (mean - 1 - 1e-5) / np.maximum(error, max(float(np.median(error)), 1e-5))
    return float(-np.expm1(mean.size * np.log1p(-stats.t.sf(score.max(), len(passes) - 1))))


def _picture(path: Path, images: list[np.ndarray]) -> None:
    from purelight_format.srgb import png

    images = [image.repeat(3, 0).repeat(3, 1) for image in images]
    level = 0.8 / max(float(np.quantile(images[-1], 0.98)), 1e-9)
    atomic.write_bytes(path, png(level * np.concatenate(images, 1)))


def subjects(options: argparse.Namespace) -> list[Subject]:
    """The lamps, exported from their runs if they are not yet."""
    from purelight_export.export import export

    found = []
    for name in options.lamps:
        scenes = options.output / "lamps"
        scene, dark = (finished_lamps.write(scenes, name, on=on) for on in (True, False))
        bundle = options.output / f"{name}.plux"
        if not bundle.is_file():
            export(options.runs / name, bundle)
        found.append(Subject(name, scene, dark, bundle))
    return found


def main() -> int:
    """Measures the lamps; figures go to stdout and OUTPUT/finishes.json."""
    parser = command.Parser(prog="python -m benchmarks.finishes", description=__doc__)
    add = parser.add_argument
    add("--runs", type=Path)
    add("--scenes", type=Path, help="only write the lamps' scenes")
    add("--output", type=Path, default=Path("out/finishes"))
    add("--lamps", nargs="+", default=list(finished_lamps.LAMPS))
    add("--rooms", nargs="+", choices=ROOMS, default=ROOMS[:2])
    add("--states", nargs="+", choices=STATES, default=STATES)
    add("--truth", choices=("path", "ptracer"), default="path")
    add("--mode", default="accurate")
    add("--size", type=command.whole(1), default=96)
    add("--spp", type=command.whole(1), default=256)
    add("--truth-spp", type=command.whole(1), default=1024)
    options = parser.parse_args()
    if options.scenes:
        for name in options.lamps:
            print(finished_lamps.write(options.scenes, name))
        return 0
    platform.use()
    import mitsuba as mi

    mi.set_log_level(mi.LogLevel.Error)
    options.output.mkdir(parents=True, exist_ok=True)
    file = options.output / "finishes.json"
    figures: Figures = json.loads(file.read_text()) if file.is_file() else {}
    for subject in subjects(options):
        own = figures.setdefault(subject.name, {})
        own["bytes"] = _bytes(subject.bundle)
        own["furnace"] = furnace(subject, options)
        print(f"{subject.name}: finishes {own['bytes']} bytes, furnace {own['furnace']}")
        for room in options.rooms:
            for state in options.states:
                found = measure(subject, room, on=state == "on", options=options)
                own[f"{room}, {state}"] = found
                _show(f"  {room}, {state}", found)
                atomic.write_bytes(file, json.dumps(figures, indent=1).encode())
    return 0


def _bytes(bundle: Path) -> int:
    """What finishes add to a bundle: the member, and their part of the manifest."""
    opened = Bundle.open(bundle, validate=False)
    stated = json.dumps([finish.to_json() for finish in opened.manifest.finishes])
    return opened.entries["surface/finish.npy"].size + len(stated)


def _show(title: str, found: Figures) -> None:
    before, after, truth = found["seconds"]
    print(f"{title}: {before:.1f} s without, {after:.1f} s with, truth {truth:.1f} s")
    for part, row in found["parts"].items():
        print(f"    {part:12} {row['pixels']:6} px   without {row['before']:6.3f}   with "
              f"{row['after']:6.3f}   noise {row['noise']:.3f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.finishes", main))
