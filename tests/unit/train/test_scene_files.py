"""What a lamp's scene is made of: a run goes on only with the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from purelight_train.light.scene_files import scene_digest, scene_files

SCENES = {
    "beside": '<string name="filename" value="arm.ply"/>',
    "elsewhere": '<string name="filename" value="../library/arm.ply"/>',
    "by a folder": '<path value="../library"/><string value=\'arm.ply\' name="filename"/>',
    "by a default": '<default name="arm" value="../library/arm.ply"/><string value="$arm"/>',
    "included": '<include filename="../library/part.xml"/>',
    "escaped": '<string name="filename" value="arm &amp; base.ply"/>',
}
PART = '<scene version="3.0.0"><string name="filename" value="arm.ply"/></scene>'


@pytest.mark.parametrize("kind", SCENES)
def test_named_files_count_and_others_do_not(tmp_path: Path, kind: str) -> None:
    folder, library = tmp_path / "lamp", tmp_path / "library"
    folder.mkdir()
    library.mkdir()
    scene = folder / "lamp.xml"
    scene.write_text(f'<scene version="3.0.0">{SCENES[kind]}</scene>')
    (library / "part.xml").write_text(PART)
    arms = [folder / "arm.ply", library / "arm.ply", folder / "arm & base.ply"]
    arm = arms[{"beside": 0, "escaped": 2}.get(kind, 1)]
    arm.write_bytes(b"1")
    first = scene_digest(scene)
    assert arm in scene_files(scene)
    (folder / "other.ply").write_bytes(b"1")
    assert scene_digest(scene) == first
    arm.write_bytes(b"2")
    assert scene_digest(scene) != first


def test_scenes_that_include_each_other_end(tmp_path: Path) -> None:
    for name, other in (("a", "b"), ("b", "a")):
        (tmp_path / f"{name}.xml").write_text(f'<scene><include filename="{other}.xml"/></scene>')
    assert scene_files(tmp_path / "a.xml") == {tmp_path / "b.xml"}
