"""Keys of jobs: what changes them, and what does not."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from purelight_catalogue.entries import Entry
from purelight_catalogue.inputs import input_digest
from purelight_catalogue.jobs import Settings, jobs_of
from purelight_format.errors import PureLightError


def keys(entry: Entry, settings: Settings = Settings()) -> dict[str, str]:  # noqa: B008
    return {job.stage: job.key for job in jobs_of(entry, settings)}


def test_only_what_depends_on_a_change_gets_a_new_key(entries: list[Entry]) -> None:
    entry = entries[0]
    before = keys(entry)
    assert keys(entry) == before
    brighter = keys(replace(entry, lumens=806.0))
    assert brighter["train"] == before["train"]
    assert brighter["export"] != before["export"]
    assert brighter["check"] != before["check"]
    larger = keys(entry, Settings(picture=512))
    assert [s for s in before if larger[s] != before[s]] == ["picture"]
    other = keys(entry, Settings(preset="standard"))
    assert all(other[stage] != before[stage] for stage in before)


def test_the_date_is_in_photometry_alone(entries: list[Entry]) -> None:
    asked = Settings(photons=1)
    before, later = (keys(entries[0], s) for s in (asked, replace(asked, issued="2026-01-31")))
    same = [stage for stage in before if later[stage] == before[stage]]
    assert same == ["train", "photons"]


def test_a_target_error_adds_a_stage(entries: list[Entry]) -> None:
    jobs = jobs_of(entries[0], Settings(target_error=0.05))
    assert [job.stage for job in jobs] == ["train", "size", "export", "check", "picture"]
    assert jobs[2].before == {"run": jobs[1].key}


def test_the_same_lamp_elsewhere_has_the_same_keys(entries: list[Entry], tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere/desk.xml"
    moved.parent.mkdir()
    shutil.copyfile(entries[0].file, moved)
    assert keys(replace(entries[0], file=moved))["train"] == keys(entries[0])["train"]


def test_what_a_lamp_is_made_to_be_is_traced_anew_and_nothing_else(entries: list[Entry]) -> None:
    entry, asked = entries[0], Settings(photons=1)
    before = keys(entry, asked)
    for options in ({"emitter": ("bulb=806lm",)}, {"units": ("mm",)}):
        assert keys(replace(entry, options=options), asked)["photons"] != before["photons"]
    assert keys(entry, replace(asked, preset="standard"))["photons"] == before["photons"]
    brighter = keys(replace(entry, lumens=806.0), asked)
    assert brighter["photons"] == before["photons"]
    assert brighter["photometry"] != before["photometry"]


def test_light_is_traced_behind_the_training(entries: list[Entry], tmp_path: Path) -> None:
    jobs = {job.stage: job for job in jobs_of(entries[0], Settings(photons=1))}
    assert jobs["photons"].before == {"run": jobs["train"].key}
    rays = tmp_path / "led.tm25ray"
    rays.touch()
    assert "photons" not in keys(Entry("led", rays), Settings(photons=1))


def test_what_a_lamp_names_is_part_of_it(tmp_path: Path) -> None:
    lamp, mesh = tmp_path / "lamp.obj", tmp_path / "meshes/wood.png"
    mesh.parent.mkdir()
    lamp.write_text("mtllib lamp.mtl")
    (tmp_path / "lamp.mtl").write_text("map_Kd meshes/wood.png")
    mesh.write_bytes(b"1")
    (tmp_path / "other.png").write_bytes(b"1")
    first = input_digest(lamp)
    (tmp_path / "other.png").write_bytes(b"2")
    assert input_digest(lamp) == first
    mesh.write_bytes(b"2")
    assert input_digest(lamp) != first


def test_names_of_other_alphabets_in_a_lamps_folder(tmp_path: Path) -> None:
    """As archives from elsewhere leave them: no text in UTF-8; and endings within endings."""
    lamp = tmp_path / "lamp.obj"
    lamp.write_bytes(b"# caf\xe9.jpg, wood.jp, no ending: README\n")
    named = [tmp_path / os.fsdecode(n) for n in (b"caf\xe9.jpg", b"wood.jp", b"README")]
    others = [tmp_path / os.fsdecode(n) for n in (b"th\xe9.jpg", b"wood.jpg", b"READ.ME")]
    for path in (*named, *others):
        path.write_bytes(b"1")
    first = input_digest(lamp)
    for path in others:
        path.write_bytes(b"2")
        assert input_digest(lamp) == first
    for path in named:
        path.write_bytes(b"2")
        assert input_digest(lamp) != first
        path.write_bytes(b"1")


ESCAPED = {
    "lamp.gltf": '{"buffers": [{"uri": "my%20lamp%20(1).bin"}]}',
    "scene.gltf": '{"buffers": [{"uri": "l\\u00e4mp.bin"}]}',
    "lamp.xml": '<scene><string value="meshes/arm &amp; base&#x28;1).ply"/></scene>',
    "lamp.usda": "#usda 1.0\n# @lamp.gltf@",
}
MEANT = {
    "lamp.gltf": "my lamp (1).bin", "scene.gltf": "lämp.bin", "lamp.xml": "arm & base(1).ply",
    "lamp.usda": "my lamp (1).bin",
}  # fmt: skip


@pytest.mark.parametrize("name", ESCAPED)
def test_a_name_counts_however_the_format_writes_it(tmp_path: Path, name: str) -> None:
    for file, text in ESCAPED.items():
        (tmp_path / file).write_text(text)
    (tmp_path / MEANT[name]).write_bytes(b"1")
    first = input_digest(tmp_path / name)
    (tmp_path / MEANT[name]).write_bytes(b"2")
    assert input_digest(tmp_path / name) != first


LIBRARY = {
    "lamp.gltf": '{"images": [{"uri": "../library/old%20wood.png"}]}',
    "lamp.xml": '<scene><string name="filename" value="../library/old wood.png"/></scene>',
    "lamp.mtl": "newmtl a\nmap_Kd -blendu on ..\\library\\old wood.png\n",
    "lamp.usda": "#usda 1.0\n(subLayers = [@../library/parts.usda@])",
}


@pytest.mark.parametrize("name", LIBRARY)
def test_files_of_other_folders_count(tmp_path: Path, name: str) -> None:
    lamp, wood = tmp_path / "lamps" / name, tmp_path / "library/old wood.png"
    for folder in (lamp.parent, wood.parent):
        folder.mkdir()
    lamp.write_text(LIBRARY[name])
    (wood.parent / "parts.usda").write_text("#usda 1.0\nasset a = @old wood.png@")
    wood.write_bytes(b"1")
    first = input_digest(lamp)
    lamp.parent.rename(tmp_path / "moved")
    assert input_digest(tmp_path / "moved" / name) == first
    wood.write_bytes(b"2")
    assert input_digest(tmp_path / "moved" / name) != first


@pytest.mark.parametrize("suffix", ["usdc", "usd"])
def test_binary_usd_names_its_textures_and_other_layers(tmp_path: Path, suffix: str) -> None:
    from pxr import Sdf, Usd

    # Many names that are alike are compressed, so that none is there as it is
    names = [f"lamp_{part}_{look}.png" for part in ("shade", "base") for look in ("color", "rough")]
    lamp, parts = tmp_path / f"lamp.{suffix}", tmp_path / "parts.usdc"
    inner, outer = Usd.Stage.CreateNew(str(parts)), Usd.Stage.CreateNew(str(lamp))
    prim = inner.DefinePrim("/Lamp", "Xform")
    for k, name in enumerate((*names, "unlike.png")):
        (tmp_path / name).write_bytes(b"1")
        prim.CreateAttribute(f"file{k}", Sdf.ValueTypeNames.Asset).Set(f"./{name}")
    outer.DefinePrim("/Lamp", "Xform").GetReferences().AddReference("./parts.usdc", "/Lamp")
    inner.Save()
    outer.Save()
    (tmp_path / "other.png").write_bytes(b"1")
    before = input_digest(lamp)
    (tmp_path / "other.png").write_bytes(b"2")
    assert input_digest(lamp) == before
    for name in (*names, "parts.usdc"):
        kept = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(kept + b"\0")
        assert input_digest(lamp) != before, name
        (tmp_path / name).write_bytes(kept)


def test_binary_usd_that_is_broken_depends_on_all_beside_it(tmp_path: Path) -> None:
    lamp, other = tmp_path / "lamp.usdc", tmp_path / "other.png"
    lamp.write_bytes(b"PXR-USDC and nothing more")
    other.write_bytes(b"1")
    before = input_digest(lamp)
    other.write_bytes(b"2")
    assert input_digest(lamp) != before


def test_a_lamp_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match="no such file"):
        jobs_of(Entry("x", tmp_path / "x.xml"), Settings())
