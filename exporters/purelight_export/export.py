"""From a run directory to a bundle, with its USD asset and photometry beside it."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from functools import cached_property
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from tqdm import tqdm

from purelight_export.choices import EULUMDAT, IES, NETWORKS
from purelight_export.parts import Part, make_parts, require_agreement
from purelight_export.photometry import (
    Intensity,
    eulumdat_file,
    ies_file,
    intensity,
    unit_ies_file,
)
from purelight_export.siblings import ASSET, FRAGMENT, SHAPE, check_beside, check_name
from purelight_format import atomic, bundle, color
from purelight_format.camera import Camera
from purelight_format.errors import PureLightError
from purelight_format.members import MANIFEST, PHOTOMETRY, PREVIEW
from purelight_format.members.manifest import FAINTEST, LONGEST_NAME, Manifest, NetworkInfo, bright
from purelight_format.members.surface import Surface
from purelight_format.networks.golden import golden_vectors
from purelight_format.networks.probes import Extent
from purelight_format.networks.profile import inspect
from purelight_format.networks.tiers import PORTABLE, fault
from purelight_format.srgb import png
from purelight_format.usd import asset_layer
from purelight_format.usd.guide import likenesses
from purelight_format.verdict import caption, figures, words
from purelight_onnx.luminaire import Luminaire
from purelight_onnx.viewer import render
from purelight_train.fragment import KEPT, write_fragment
from purelight_train.runs.run_directory import RunDirectory

PREVIEW_SIZE = 256
IN_WATTS = ("flux_error", "student_flux", "student_flux_error")
MEASURED = ("rays", "exit_surface", "colors", "not_carried", "relative_error")
FIDELITY = (*IN_WATTS, "held_out_gain_nats")

Members = dict[str, bytes]


def export(
    run_path: str | Path,
    output: str | Path,
    *,
    networks: Sequence[str] = NETWORKS,
    compact: bool = False,
    name: str | None = None,
    lumens: float | None = None,
    photometry: Sequence[str] = (IES,),
    issued: str | None = None,
) -> list[Path]:
    """Writes lamp.plux, and beside it lamp.ies, lamp.shape.ies and lamp.usda.

    Parts that training kept out of the networks are in the USD asset, and for Mitsuba in
    lamp.kept.xml, whose meshes are in lamp.kept/.

    Every network is compared with the trained one, and a draft of the bundle is opened, checked
    and rendered, before anything appears at `output`. The USD asset comes last, so that none ever
    names a bundle that is not there.

    Arguments:
        run_path: A finished run directory.
        networks: Which of `choices.NETWORKS` the bundle carries; what is required always.
        compact: Whether grid tables are stored with 15 bits.
        name: What to call the lamp, a printable text; like its scene by default.
        lumens: Luminous flux that all of its light is scaled to; as traced by default.
        photometry: Which photometric files go beside the bundle, some of `choices.PHOTOMETRIC`.
        issued: Date in photometric files, YYYY-MM-DD; the day the run was finished by default.

    Returns:
        The files written.

    Raises:
        PureLightError: If the run is not finished, a network does not survive the export, the
            place cannot be written or a USD layer cannot name it, a file there that no export
            wrote would be replaced, the name is none, or the lamp cannot have so many lumens.
    """
    output = Path(output)
    check_name(output)
    if name and plain_name(name) != name:
        raise PureLightError(
            f"{name!r}: no name of a lamp; give 1 to {LONGEST_NAME} printable characters"
        )
    atomic.check_file(output)
    check_beside(output, photometry, kept=_kept(Path(run_path)).is_file())
    run = RunDirectory.open(run_path)
    if lumens is not None:
        run = replace(run, power=power(run, lumens))
    lamp = Facts(run, name or scene_name(run), lumens, issued)
    parts = make_parts(run, lamp.extent, networks, compact=compact)
    members, infos, errors = _networks(parts, compact=compact)
    members |= lamp.surface.to_members()
    members[PHOTOMETRY] = lamp.photometry
    manifest = lamp.manifest(infos, {"onnx_error": errors}, compact=compact)
    manifest = replace(manifest, tier=_tier(parts))
    members[PREVIEW] = _preview(manifest, members)
    members |= lamp.layer(manifest)
    written = bundle.write(output, manifest, members)
    return [output, *_beside(lamp, written, photometry)]


def scene_name(run: RunDirectory) -> str:
    """What the scene of a run is called, as a name that a manifest may have."""
    scene = run.config["luminaire"].replace("\\", "/")  # Where the run may have been made.
    return plain_name(PurePath(scene).stem) or "lamp"


def plain_name(text: str) -> str:
    """A text with blanks for what cannot be printed, and no longer than a name may be."""
    return "".join(c if c.isprintable() else " " for c in text)[:LONGEST_NAME]


def _tier(parts: Sequence[Part]) -> str | None:
    """The tier that all networks keep to, if there is one."""
    portable = not any(fault(PORTABLE, part.model, part.name) for part in parts)
    return PORTABLE.name if portable else None


def power(run: RunDirectory, wanted: float) -> float:
    """The factor that gives a run's lamp so many lumens.

    Raises:
        PureLightError: If the lamp is dark, or no bundle may have that much or little light.
    """
    traced = color.lumens(run.description.flux)
    if not traced > 0:
        raise PureLightError(f"{run.path}: the lamp gives no light, so it cannot have --lumens")
    factor, about = wanted / traced, run.description
    light = [factor * x for x in (*about.flux, about.radiance_scale) if x > 0]
    if not all(map(bright, light)):
        raise PureLightError(
            f"--lumens {wanted:g}: a bundle cannot hold light so "
            f"{'faint' if min(light) < FAINTEST else 'strong'}; give another number"
        )
    return factor


@dataclass(frozen=True)
class Facts:
    """What the bundle says of the lamp besides its networks.

    Arguments:
        run: A finished run directory.
        name: What to call the lamp.
        lumens: What its light was scaled to by the run's factor, if it was.
        date: In photometric files, YYYY-MM-DD, if not that of the run.
    """

    run: RunDirectory
    name: str
    lumens: float | None = None
    date: str | None = None

    @cached_property
    def surface(self) -> Surface:
        """The exit surface; light that met no triangle is spread in proportion."""
        arrays = self.run.read_arrays("surface.npz")
        flux = arrays["triangle_flux"].astype(np.float64)
        total = flux.sum(0)
        flux *= np.divide(self.run.description.flux, total, out=np.zeros(3), where=total > 0)
        finish = arrays["finish"] if self.run.finishes else None
        return Surface(arrays["positions"], arrays["triangles"], flux.astype(np.float32), finish)

    def layer(self, manifest: Manifest) -> Members:
        """The layer inside the bundle, where that has more than what the bundle itself says.

        It shows likenesses of the kept parts; the asset beside has them as they are.
        """
        if not self.run.kept:
            return {}
        name = f"{asset_layer.identifier(manifest.name)}.usda"
        paths = asset_layer.Paths(f"./{MANIFEST}", f"./{name}", photometry=f"./{PHOTOMETRY}")
        text = asset_layer.layer_text(manifest, self.surface, paths, likenesses(self.run.kept))
        return {name: text.encode()}

    @property
    def extent(self) -> Extent:
        surface, about = self.surface, self.run.description
        return Extent(surface.positions, surface.triangles, about.sphere, about.r_max)

    @cached_property
    def intensity(self) -> Intensity:
        escaped = self.run.read_arrays("escaped.npz")
        return intensity(escaped["direction"], escaped["weight"], self.run.description.flux)

    @cached_property
    def issued(self) -> str:
        """Some day, or else that of the run's end: a second export gives the same bytes."""
        if self.date:
            return self.date
        seconds = (self.run.path / "metrics.json").stat().st_mtime
        return datetime.fromtimestamp(seconds, timezone.utc).strftime("%Y-%m-%d")

    @cached_property
    def photometry(self) -> bytes:
        radius = self.run.description.sphere.radius
        return ies_file(self.intensity, name=self.name, issued=self.issued, radius=radius)

    @property
    def eulumdat(self) -> bytes:
        return eulumdat_file(self.intensity, self.surface, name=self.name, issued=self.issued)

    def manifest(
        self, infos: dict[str, NetworkInfo], measured: dict[str, Any], *, compact: bool
    ) -> Manifest:
        """The manifest, still without its members."""
        description = self.run.description
        scaled = {"lumens": self.lumens, "power_factor": self.run.power}
        return Manifest(
            name=self.name,
            bounding_sphere=description.sphere,
            flux=description.flux,
            radiance_scale=description.radiance_scale,
            r_max=description.r_max,
            channels=description.channels,
            networks=infos,
            provenance={
                **self.run.provenance,
                "precision": "compact" if compact else "fp32",
                **({} if self.lumens is None else scaled),
                **self._measured,
            },
            fidelity=self.fidelity | self._verdict(infos) | measured,
            finishes=self.run.finishes,
        )

    def _verdict(self, networks: Collection[str]) -> dict[str, Any]:
        """What training found of the networks that the bundle carries."""
        found = figures.read(self.run.read_json("metrics.json").get("verdict"))
        return {} if found is None else {"verdict": found.of_networks(networks).to_json()}

    @property
    def _measured(self) -> dict[str, Any]:
        """What is to be known of a lamp that was measured: from which rays, and what is missing."""
        found = self.run.read_json("metrics.json").get("measured")
        return {"measured": {key: found[key] for key in MEASURED}} if found else {}

    @property
    def fidelity(self) -> dict[str, Any]:
        """The figures of training, those in W scaled like the lamp."""
        metrics = self.run.read_json("metrics.json")
        found = {key: metrics[key] for key in FIDELITY if key in metrics}
        watts = {key: [x * self.run.power for x in found[key]] for key in IN_WATTS if key in found}
        return found | watts


def _networks(
    parts: Sequence[Part], *, compact: bool
) -> tuple[Members, dict[str, NetworkInfo], dict[str, float]]:
    """Checks the networks; returns their members, manifest entries, and errors against torch."""
    members: Members = {}
    infos: dict[str, NetworkInfo] = {}
    errors: dict[str, float] = {}
    for part in tqdm(parts, desc="export", unit="network", delay=1):
        errors[part.name] = float(f"{require_agreement(part, compact=compact):.2g}")
        member, cost = f"networks/{part.name}.onnx", inspect(part.model, part.name)
        members[member] = part.model
        members |= golden_vectors(part.name, part.model, part.probes, part.units).to_members()
        infos[part.name] = NetworkInfo(
            member, cost.macs_per_sample, cost.floats_per_sample, len(part.model),
            part.uniform_fraction,
        )  # fmt: skip
    return members, infos, errors


def _preview(manifest: Manifest, members: Members) -> bytes:
    """Renders the lamp from a draft of the bundle, which proves that the bundle works."""
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "draft.plux"
        bundle.write(draft, manifest, members)
        luminaire = Luminaire.open(draft)
        for network in manifest.networks:
            luminaire.network(network)
        camera = Camera.orbit(manifest.bounding_sphere, size=PREVIEW_SIZE)
        picture = png(render(luminaire, camera, samples=4))
    found = figures.read(manifest.fidelity.get("verdict"))
    return picture if found is None else caption.under(picture, words.judge(found).caption)


def _beside(lamp: Facts, written: bundle.Bundle, photometry: Sequence[str] = (IES,)) -> list[Path]:
    """Writes the photometric files, the shape for USD lights, and the USD asset."""
    texts = {IES: lambda: lamp.photometry, EULUMDAT: lambda: lamp.eulumdat}
    files = [written.path.with_suffix(f".{kind}") for kind in photometry]
    for file, kind in zip(files, photometry, strict=True):
        atomic.write_bytes(file, texts[kind]())
    shape, asset = (written.path.with_suffix(suffix) for suffix in (SHAPE, ASSET))
    paths = asset_layer.Paths(
        f"./{written.path.name}", f"./{asset.name}", written.digest, f"./{shape.name}"
    )
    atomic.write_bytes(shape, unit_ies_file(lamp.intensity, name=lamp.name, issued=lamp.issued))
    text = asset_layer.layer_text(written.manifest, lamp.surface, paths, lamp.run.kept)
    kept = _kept_scene(lamp.run, written.path)
    atomic.write_bytes(asset, text.encode())
    return [*files, shape, *kept, asset]


def _kept_scene(run: RunDirectory, bundle_path: Path) -> list[Path]:
    """Writes the kept parts beside the bundle, as a scene that Mitsuba's scenes may include."""
    source = _kept(run.path)
    if not source.is_file():
        return []
    return [write_fragment(source, bundle_path.with_suffix(FRAGMENT))]


def _kept(run_path: Path) -> Path:
    """The scene of a run's kept parts, where it has any."""
    return run_path / "kept" / KEPT
