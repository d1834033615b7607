"""From a file of any format to a folder with a Mitsuba scene of the lamp."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format.color import lumens
from purelight_format.errors import PureLightError
from purelight_import import formats
from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material
from purelight_import.model.names import tidy
from purelight_import.options import AUTO, Options
from purelight_import.parts import emitters
from purelight_import.parts.choice import LISTED, Named, chosen
from purelight_import.parts.coordinates import placeable
from purelight_import.parts.glass import settled
from purelight_import.parts.merging import merged
from purelight_import.parts.pieces import taken_apart
from purelight_import.parts.placing import placed
from purelight_import.parts.points import with_size
from purelight_import.parts.room_parts import room_lines
from purelight_import.write import folder as folders
from purelight_import.write import table
from purelight_import.write.scene import write_scene

# Names that say nothing of the lamp, of files and folders
GENERAL = {"scene", "model", "untitled", "lamp", "luminaire", "mesh", "object", "root", "main",
           "scene_collection", "auxscene", "osg_scene", "sketchfab_scene", "sketchfab_model",
           "world", "default", "models", "meshes", "objects", "scenes", "lamps", "assets", "public",
           "static", "data", "files", "source", "src", "gltf", "glb", "obj", "usd", "3d", "export",
           "exports", "download", "downloads", "desktop", "tmp"}  # fmt: skip
CUT = "a picture with values above one, which no surface reflects; they are cut to one"
Say = Callable[[str], None]
Away = Callable[[Path], Sequence[str]]


@dataclass(frozen=True)
class Imported:
    """What an import made.

    Arguments:
        scene: the lamp's file.
        parts: its parts, as records.
        notes: what could not be taken as the file says, one line for each kind.
        doubts: what seems wrong with the lamp, one line each.
    """

    scene: Path
    parts: list[dict[str, Any]]
    notes: list[str]
    doubts: list[str]


def read_lamp(path: str | Path, options: Options | None = None) -> tuple[Lamp, tuple[Part, ...]]:
    """Reads a lamp and settles what emits, in metres with +Z up.

    Returns:
        The lamp, and the parts that were kept apart from it.

    Raises:
        PureLightError: the file cannot be taken, or the options do not fit it.
    """
    path, options = Path(path), options or Options()
    lamp = placeable(formats.read(path))
    lamp = replace(lamp, name=_name(lamp, path, options))
    lamp = taken_apart(lamp, options.pieces)
    lamp, kept = placed(*_without(lamp, options), options.units, options.up)
    for line in room_lines(lamp):
        lamp.notes(line)
    lamp = with_size(lamp)
    lamp = settled(lamp, dict(_glass(options)))
    lamp = lamp_lit(lamp, options)
    for part in lamp.parts:
        if isinstance(part.material, Material) and part.material.cut:
            lamp.notes(CUT, part.name)
    kept = settled(Lamp(lamp.name, kept, (), lamp.frame), {}).parts if kept else ()
    for part in kept:
        if part.radiance is not None:
            lamp.notes("kept apart, and dark there although it emits", part.name)
    return merged(lamp), kept


def lamp_lit(lamp: Lamp, options: Options) -> Lamp:
    """The lamp with its emitters as chosen."""
    choices = [emitters.parse(text) for text in options.emitters]
    return emitters.light_up(lamp, choices, options.lumens, options.kelvin)


def import_lamp(
    path: str | Path, output: str | Path, options: Options | None = None, *,
    picture: bool = True, away: Away | None = None,
) -> Imported:  # fmt: skip
    """Writes a lamp as a Mitsuba scene, with meshes, pictures, a list of parts and a portrait.

    Arguments:
        output: a folder; an earlier import there is replaced, unless it was changed.
        picture: whether to render the portrait.
        away: names the parts of a lamp's scene that `--keep auto` means.

    Raises:
        PureLightError: the file cannot be taken, the options do not fit it, or the folder cannot
            be written; nothing is left behind.
    """
    path, output, options = Path(path), Path(output).resolve(), options or Options()
    folders.check(output)
    if AUTO in options.keep and away is None:
        raise PureLightError(f"--keep {AUTO}: needs the lamp's light; say it to purelight-train")
    lamp, kept = read_lamp(path, options)
    if AUTO in options.keep and away is not None:
        lamp, kept = _set_apart(lamp, kept, away)
    scene = f"{tidy(lamp.name)}.xml"
    if scene == folders.KEPT:
        scene = "kept_lamp.xml"
    records = table.rows(lamp.parts)
    record: dict[str, Any] = {
        "lamp": lamp.name, "scene": scene, "source": path.name, "source_digest": digest(path),
        "options": options.to_dict(), "parts": records, "kept": table.rows(kept),
        "notes": lamp.notes.lines(),
    }  # fmt: skip
    with folders.replaced(output, record) as draft:
        write_scene(draft / scene, lamp, lamp.parts, path.name)
        if kept:
            dark = tuple(replace(part, radiance=None) for part in kept)
            write_scene(draft / folders.KEPT, lamp, dark, path.name)
        (draft / folders.TEXT).write_text(table.text(records) + "\n", "utf-8")
        record["doubts"] = _looked_at(draft / scene, lamp, picture=picture)
    return Imported(output / scene, records, record["notes"], record["doubts"])


def _set_apart(lamp: Lamp, kept: tuple[Part, ...], away: Away) -> tuple[Lamp, tuple[Part, ...]]:
    """Keeps what is away from the light apart too, and notes what that is."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "lamp.xml"
        write_scene(scene, lamp, lamp.parts, "")
        names = set(away(scene))
    apart = tuple(p for p in lamp.parts if p.name in names)
    said = ", ".join(p.name for p in apart[:LISTED]) + (", ..." if len(apart) > LISTED else "")
    lamp.notes(
        f"--keep {AUTO}: {said}: opaque and away from the light, kept apart as geometry"
        if apart
        else f"--keep {AUTO}: no opaque part is away from the light; none is kept apart"
    )
    return replace(lamp, parts=tuple(p for p in lamp.parts if p.name not in names)), kept + apart


def _looked_at(scene: Path, lamp: Lamp, *, picture: bool) -> list[str]:
    """Loads what was written: its doubts, and its portrait beside it."""
    from purelight_mitsuba import platform

    platform.use("llvm_ad_rgb")
    from purelight_import.sanity import doubts
    from purelight_mitsuba.scene_file import load_scene

    loaded = load_scene(scene, optimize=False)
    found = doubts(loaded)
    if picture:
        from purelight_import.write.portrait import portrait

        light = sum(lumens(emitters.flux(p, p.radiance)) for p in lamp.parts if p.radiance)
        places = np.concatenate([p.mesh.positions for p in lamp.parts])
        scene.with_suffix(".png").write_bytes(portrait(scene, light, places))
    return found


def digest(path: Path) -> str:
    """SHA-256 of a lamp's file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _glass(options: Options) -> list[tuple[str, str]]:
    pairs = (text.rpartition("=") for text in options.glass)
    return [(pattern, kind) for pattern, _, kind in pairs]


def _patterns(options: Options) -> list[str]:
    """What of --keep names parts."""
    return [pattern for pattern in options.keep if pattern != AUTO]


def _name(lamp: Lamp, path: Path, options: Options) -> str:
    """What to call the lamp: as said, as the file's scene, as the file, or as its folder."""
    if options.name:
        if not tidy(options.name):
            raise PureLightError(f"--name {options.name}: give a name with letters in it")
        return options.name
    for name in (lamp.name, path.stem, path.resolve().parent.name):
        if tidy(name) and tidy(name).lower() not in GENERAL:
            return tidy(name)
    return tidy(path.stem) or "lamp"


def _without(lamp: Lamp, options: Options) -> tuple[Lamp, tuple[Part, ...]]:
    """The lamp without what is left out or kept apart, and what is kept.

    Raises:
        PureLightError: a name fits nothing, or nothing is left.
    """
    items: list[Named] = [*lamp.parts, *lamp.points]
    for pattern, _ in _glass(options):
        chosen(pattern, lamp.parts, "--glass")
    apart = {id(x) for pattern in _patterns(options) for x in chosen(pattern, lamp.parts, "--keep")}
    away = {id(x) for pattern in options.omit for x in chosen(pattern, items, "--omit")} | apart
    kept = tuple(p for p in lamp.parts if id(p) in apart)
    parts = tuple(p for p in lamp.parts if id(p) not in away)
    points = tuple(p for p in lamp.points if id(p) not in away)
    if not parts and not points:
        raise PureLightError("nothing of the lamp is left; name fewer parts in --omit and --keep")
    return replace(lamp, parts=parts, points=points), kept
