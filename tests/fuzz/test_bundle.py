"""Whole bundles with one damaged member and digests made anew, so that the damage is met."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path

import numpy as np
from pxr import Sdf, Tf, UsdUtils

from purelight_format import npy, usd_layer
from purelight_format.issues import FormatError
from purelight_format.validate import validate
from tests.assets import lamp
from tests.assets.mutation import mutate, rounds

ARRAY_WORDS = (b"'<f8'", b"True", b"(0, 3)", b"|O", b"99999999999", b"\x93NUMPY\2\0")
LAYER_WORDS = (
    b"@/etc/passwd@", b"@./../x.usda@", b"@@@http://h/x.json@@@", b"references = @./outside.usda@",
    b"subLayers = [@./b.usd@]", b'"""', b"'", b"#", b"\n", b"\\",
)  # fmt: skip


@rounds(600, 60_000)
def test_damaged_bundles_are_answered(rounds: int) -> None:
    rng = np.random.default_rng(41)
    good = lamp.good()
    names = [name for name in good if len(good[name]) < 20_000]
    seen: Counter[str] = Counter()
    for k in range(rounds):
        name = names[k % len(names)]
        words = LAYER_WORDS if name.endswith(".usda") else ARRAY_WORDS
        spoilt = {**good, name: mutate(good[name], rng, words)}
        try:
            data = lamp.seal(spoilt)
        except ValueError:
            continue  # The manifest itself, which has its own test, is no longer JSON.
        report = validate(data)
        seen.update(issue.code.name.split("_")[1] for issue in report.issues)
    assert {"NPY", "ONNX", "USD", "GOLDEN", "PREVIEW"} <= set(seen)


@rounds(20_000, 1_000_000)
def test_damaged_arrays_are_refused_or_as_large_as_they_say(rounds: int) -> None:
    rng = np.random.default_rng(42)
    good = npy.dumps(np.arange(12, dtype="<f4").reshape(4, 3))
    accepted = 0
    for _ in range(rounds):
        data = mutate(good, rng, ARRAY_WORDS)
        try:
            array = npy.loads(data, "test", "<f4")
        except FormatError:
            continue
        accepted += 1
        assert array.nbytes < len(data)
        assert npy.dumps(array)[-array.nbytes or None :] == data[-array.nbytes or None :]
    assert 0 < accepted < rounds


def readable(path: Path) -> bool:
    try:
        return Sdf.Layer.OpenAsAnonymous(str(path)) is not None
    except Tf.ErrorException:
        return False


@rounds(400, 20_000)
def test_an_accepted_layer_opens_nothing_outside_its_folder(tmp_path: Path, rounds: int) -> None:
    """What our words-only check accepts, USD itself finds to name only what lies beside it."""
    rng = np.random.default_rng(43)
    good = lamp.good()
    name = next(iter(good))
    for neighbour in ("manifest.json", "photometry.ies"):
        (tmp_path / neighbour).write_bytes(good[neighbour])
    opened = 0
    for k in range(rounds):
        data = mutate(good[name], rng, LAYER_WORDS)
        try:
            if list(usd_layer.check(data, name, good)):
                continue
        except FormatError:
            continue
        path = tmp_path / f"{k}" / name
        path.parent.mkdir()
        for neighbour in ("manifest.json", "photometry.ies"):
            shutil.copy(tmp_path / neighbour, path.parent)
        path.write_bytes(data)
        if not readable(path):
            continue
        layers, assets, missing = UsdUtils.ComputeAllDependencies(str(path))
        opened += 1
        assert {layer.realPath for layer in layers} == {str(path)}
        assert {Path(a).parent for a in assets} <= {path.parent}
        assert not missing
    assert opened > 0
