"""Our own reader of ONNX models against the package `onnx`: same fields, same verdicts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from google.protobuf.message import DecodeError

from purelight_format.issues import FormatError
from purelight_format.networks import model, profile, reference, tiers
from purelight_format.networks.messages import BrokenMessageError, Message
from purelight_format.validation.validate import examine
from tests.assets import bad
from tests.support import lamp

MODEL = lamp.good()["networks/appearance.onnx"]
MUTATIONS = 400


@pytest.fixture
def without_onnx(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Python that has no ONNX, as Blender's."""
    for user in (profile, reference, tiers):
        monkeypatch.setattr(user, "load", model.own)


def verdict(data: bytes) -> list[tuple[str, str, str]]:
    issues = examine(data, depth=3).report.issues
    return [(issue.code.name, issue.location, issue.message) for issue in issues]


def made() -> Iterator[tuple[str, bytes]]:
    for code, makers in bad.ASSETS.items():
        if code.startswith(("PLX_ONNX", "PLX_GOLDEN")):
            for number, maker in enumerate(makers):
                yield f"{code}-{number}", maker()


def test_every_bad_network_has_the_same_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = dict(made())
    with_onnx = {name: verdict(data) for name, data in cases.items()}
    for user in (profile, reference, tiers):
        monkeypatch.setattr(user, "load", model.own)
    assert {name: verdict(data) for name, data in cases.items()} == with_onnx
    assert sum(bool(issues) for issues in with_onnx.values()) > 60


def test_a_good_bundle_is_good_without_onnx(without_onnx: None) -> None:
    assert verdict(lamp.seal(lamp.good())) == []


def mutations() -> Iterator[bytes]:
    """The model with a few bytes changed, taken out or doubled."""
    rng = np.random.default_rng(7)
    for _ in range(MUTATIONS):
        data = bytearray(MODEL)
        for _ in range(rng.integers(1, 4)):
            place, size = int(rng.integers(len(data))), int(rng.integers(1, 9))
            part = data[place : place + size]
            choice = rng.integers(3)
            if choice == 0:
                data[place] = int(rng.integers(256))
            elif choice == 1:
                del data[place : place + size]
            else:
                data[place:place] = part
        yield bytes(data)


def outcome(data: bytes) -> Any:
    try:
        return profile.inspect(data, "appearance")
    except FormatError as error:
        return error.issue


def test_mutations_have_the_same_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = list(mutations())
    expected = [outcome(data) for data in cases]
    monkeypatch.setattr(profile, "load", model.own)
    assert [outcome(data) for data in cases] == expected
    assert len({str(found) for found in expected}) > 10


def test_mutations_have_the_same_fields() -> None:
    compared = 0
    for data in mutations():
        try:
            theirs = onnx.ModelProto.FromString(data)
        except DecodeError:
            with pytest.raises(BrokenMessageError):
                model.own(data)
            continue
        require_same(model.own(data), theirs)
        compared += 1
    assert compared > MUTATIONS // 10


def require_same(own: Message, theirs: Any) -> None:
    """Every field that our reader knows has the same value, and is given or not."""
    for field in own._fields.values():
        if not hasattr(theirs, field.name):
            continue  # Of a later version of ONNX than the one installed.
        mine = getattr(own, field.name)
        try:
            other = getattr(theirs, field.name)
        except UnicodeDecodeError:
            assert isinstance(mine, bytes)
            continue
        if field.many:
            assert len(mine) == len(other), field
            pairs = zip(mine, other, strict=True)
        else:
            assert own.HasField(field.name) == theirs.HasField(field.name), field
            pairs = iter([(mine, other)] if own.HasField(field.name) else [])
        for a, b in pairs:
            if isinstance(a, Message):
                require_same(a, b)
            else:
                assert a == b or (a != a and b != b), field


def test_what_protobuf_skips_or_joins_is_skipped_or_joined() -> None:
    """Groups, unknown numbers, messages given twice, packed numbers, the last of a choice."""
    unknown = b"\xfb\x07\x08\x01\xfc\x07" + b"\x92\x03\x02hi"
    twice = MODEL + b"\x3a\x05\x52\x03doc"
    for data in (MODEL + unknown, twice):
        require_same(model.own(data), onnx.ModelProto.FromString(data))
    assert model.own(twice).graph.doc_string == "doc"
    dims = onnx.TensorProto(dims=[3, 1 << 40, -1]).SerializeToString()
    packed = b"\x0a\x02\x03\x04"
    for data in (dims, packed):
        own = Message(model.SCHEMA, "tensor")
        own.merge(memoryview(data))
        require_same(own, onnx.TensorProto.FromString(data))


def test_deep_nesting_is_refused() -> None:
    data = b""
    for _ in range(200):
        data = wrap(data)
    with pytest.raises(BrokenMessageError, match="deep"):
        model.own(data)


def wrap(data: bytes) -> bytes:
    """A group in a group, of an unknown number."""
    return b"\x9b\x06" + data + b"\x9c\x06"


def test_without_the_package_our_reader_is_taken(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert isinstance(model.load(MODEL), onnx.ModelProto)
    monkeypatch.setitem(__import__("sys").modules, "onnx", None)
    assert isinstance(model.load(MODEL), Message)
