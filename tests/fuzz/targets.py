"""What is fuzzed: for each target a maker of inputs, and the property that every input must have.

A property returns whether the input was accepted. Any exception but those it expects is a finding.
"""

from __future__ import annotations

import functools
import io
import json
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

from purelight_format.issues import CODES, FormatError
from purelight_format.members import container, manifest, npy, strict_json
from purelight_format.members.manifest import parse
from purelight_format.networks.profile import NetworkCost, inspect
from purelight_format.usd import layer
from purelight_format.validation.validate import examine
from tests.assets import bad
from tests.fuzz import graphs, layers, networks
from tests.fuzz.mutation import mutate
from tests.support import lamp


@dataclass(frozen=True)
class Target:
    """A part of the validator under attack.

    Arguments:
        make: an input from a random generator.
        check: the property; returns whether the input was accepted.
        share: of the inputs of a run over all targets.
    """

    make: Callable[[Random], bytes]
    check: Callable[[bytes], bool]
    share: float


@functools.cache
def good() -> dict[str, bytes]:
    """The members of the good lamp."""
    return lamp.good()


def _refused(error: FormatError, *stages: str) -> bool:
    """A refusal has a code of its own stage."""
    assert error.issue.code.name.startswith(stages)
    return False


# The container, against Python's own reader of zip files

ZIP_WORDS = (b"PK\3\4", b"PK\1\2", b"PK\5\6", b"PK\6\6", b"\x86\x19", b"\xff\xff\xff\xff", b"../")


@functools.cache
def archives() -> list[bytes]:
    return [container.pack({"a.usda": b"text", "b/c": b"", "d": bytes(100)}),
            bad.unchecked([("a", b"1"), ("b", b"2")]), container.pack({})]  # fmt: skip


def make_archive(rng: Random) -> bytes:
    return mutate(rng.choice(archives()), rng, ZIP_WORDS)


def members(data: bytes) -> dict[str, bytes] | None:
    """The members of an archive, None if it is refused."""
    try:
        entries = container.scan(data)
    except FormatError as error:
        _refused(error, "PLX_ZIP_", "PLX_FILE_")
        return None
    return {name: bytes(container.member(data, entry)) for name, entry in entries.items()}


def one_meaning(data: bytes) -> bool:
    """An accepted archive is canonical, and Python's own reader sees the same in it."""
    found = members(data)
    if found is None:
        return False
    assert container.pack(found) == data
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        assert {name: archive.read(name) for name in archive.namelist()} == found
    return True


# JSON and the manifest

JSON_WORDS = (b"NaN", b"1e999", b"-0", b"null", b"[[", b"]]", b'"\\ud800"', b"{}", b"9" * 41,
              b"\xff", b'"r_max":', b"true", b"1e-400", b'"2.0"', b'"members": {"a": 0}',
              b'"members/a"', b"\\u0000", b'"\x1b[2J"', b"9007199254740993")  # fmt: skip
TEXTS = (b'{"a": [1, 2.5e3, "x\\n", null, {"b": true}], "c": {}}', b"[[]]", b'"\\u00e4"')


def make_json(rng: Random) -> bytes:
    return mutate(rng.choice(TEXTS), rng, JSON_WORDS)


def json_as_others_read_it(data: bytes) -> bool:
    try:
        value = strict_json.loads(data, "test")
    except FormatError:
        return False
    assert value == json.loads(data)
    assert strict_json.loads(strict_json.dumps(value), "test") == value
    return True


def make_manifest(rng: Random) -> bytes:
    return mutate(good()["manifest.json"], rng, JSON_WORDS)


def manifest_comes_back(data: bytes) -> bool:
    """Either issues of the table, or a manifest that comes back the same."""
    found, issues = manifest.examine(data)
    assert all(issue.code.name in CODES for issue in issues)
    assert (found is None) == any(issue.is_error for issue in issues)
    if found is not None:
        assert parse(found.to_bytes()) == found
    return found is not None


# Arrays

ARRAY_WORDS = (b"'<f8'", b"True", b"(0, 3)", b"|O", b"99999999999", b"\x93NUMPY\2\0", b"(0, 9",
               b", 99999999999999999999", b"()", b"(3,)")  # fmt: skip


@functools.cache
def arrays() -> list[bytes]:
    import numpy as np

    floats = np.arange(12, dtype="<f4")
    return [npy.dumps(a) for a in (floats.reshape(4, 3), floats[:0].reshape(0, 3), floats[:1])]


def make_array(rng: Random) -> bytes:
    return mutate(rng.choice(arrays()), rng, ARRAY_WORDS)


def array_as_large_as_it_says(data: bytes) -> bool:
    try:
        array = npy.loads(data, "test", "<f4")
    except FormatError:
        return False
    assert array.nbytes < len(data)
    assert npy.dumps(array) == data
    return True


# Networks


@functools.cache
def models() -> dict[str, bytes]:
    """The small networks of the lamp."""
    made = {name: make().SerializeToString() for name, make in lamp.NETWORKS.items()}
    return {name: data for name, data in made.items() if len(data) < 5000}


MODEL_WORDS = (b"Loop", b"\xff" * 9, b"com.microsoft", b"\x3a\0", b"\x2a\0", b"\x0b", b"\x4a\x7f")


def make_model(rng: Random) -> bytes:
    """The network's number, and its damaged bytes."""
    index = rng.randrange(len(models()))
    return bytes([index]) + mutate(list(models().values())[index], rng, MODEL_WORDS)


def make_graph(rng: Random) -> bytes:
    """The network's number, and a model whose graph is damaged."""
    index = rng.randrange(len(models()))
    return bytes([index]) + networks.damaged(list(models().values())[index], rng)


def make_drawn_graph(rng: Random) -> bytes:
    """A model drawn node by node, for the appearance network."""
    return bytes([list(models()).index("appearance")]) + graphs.drawn(rng)


def make_heavy_graph(rng: Random) -> bytes:
    """A drawn model with wide layers."""
    return bytes([list(models()).index("appearance")]) + graphs.drawn(rng, sizes=graphs.HEAVY)


def _vetted(data: bytes) -> tuple[bytes, str, NetworkCost] | None:
    """A model, its network and cost; None if it is refused."""
    network, model = list(models())[data[0]], data[1:]
    try:
        return model, network, inspect(model, network)
    except FormatError as error:
        _refused(error, "PLX_ONNX_")
        return None


def network_as_cheap_as_stated(data: bytes, *, run: bool = False) -> bool:
    """A network that is accepted has the foretold cost, and no runtime ends on it."""
    vetted = _vetted(data)
    if vetted is None:
        return False
    model, network, _ = vetted
    networks.require_stated_cost(*vetted)
    if run:
        networks.require_a_runtime(model, network)
    return True


def network_as_fast_as_stated(data: bytes) -> bool:
    """The stated work bounds the time of the evaluators."""
    vetted = _vetted(data)
    if vetted:
        networks.require_stated_time(*vetted)
    return vetted is not None


def network_as_soon_compiled_as_foretold(data: bytes) -> bool:
    """The foretold time bounds that of Dr.Jit."""
    vetted = _vetted(data)
    return vetted is not None and networks.require_compiled(*vetted[:2])


# The USD layer

LAYER_WORDS = (
    b"@/etc/passwd@", b"@./../x.usda@", b"@@@http://h/x.json@@@", b"references = @./outside.usda@",
    b"subLayers = [@./b.usd@]", b'"""', b"'''", b"'", b"#", b"\n", b"\\", b"@@@", b"@", b"/*",
    b"*/", b"//", b"payload = </a>", b'variantSet "v" = {', b"inherits", b"(", b")", b"{", b"}",
    b'clips = { dictionary a = { string templateAssetPath = "/etc/x.###.usd" } }', b"\\@@@", b";",
    b"asset x = @/etc/passwd@",
    b"asset ", b'asset[] x = ["', b'asset y = "/etc/passwd"',
    b'string y = "\\"', b"timeSamples = { 0: @/etc/passwd@ }",
)  # fmt: skip


def layer_name() -> str:
    return next(iter(good()))


def make_layer(rng: Random) -> bytes:
    """A damaged layer of our own, or one drawn from OpenUSD's grammar."""
    if rng.random() < 0.5:
        return layers.drawn(rng)
    return mutate(good()[layer_name()], rng, LAYER_WORDS)


def layer_is_answered(data: bytes) -> bool:
    try:
        return not list(layer.check(data, layer_name(), good()))
    except FormatError as error:
        return _refused(error, "PLX_USD_")


def layer_opens_nothing_else(data: bytes) -> bool:
    """What our words-only check accepts, OpenUSD composes from this one file and its neighbours."""
    return layer_is_answered(data) and _is_alone(data)


def _is_alone(data: bytes) -> bool:
    from pxr import Tf, Usd, UsdUtils

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder).resolve() / layer_name()
        path.write_bytes(data)
        for neighbour in ("manifest.json", "photometry.ies"):
            path.with_name(neighbour).write_bytes(b"")
        try:
            stage = Usd.Stage.Open(str(path))
        except Tf.ErrorException:
            return False
        used = {layer.realPath for layer in stage.GetUsedLayers() if not layer.anonymous}
        layers, assets, missing = UsdUtils.ComputeAllDependencies(str(path))
        assert used | {layer.realPath for layer in layers} == {str(path)}
        assert {Path(asset).parent for asset in assets} <= {path.parent}
        assert not missing
        assert len(list(stage.Traverse())) < 100
    return True


# Whole bundles with one damaged member and digests made anew, so that the damage is met


@functools.cache
def small_members() -> list[str]:
    return [name for name, data in good().items() if len(data) < 20_000]


def make_bundle(rng: Random) -> bytes:
    name = rng.choice(small_members())
    words = LAYER_WORDS if name.endswith(".usda") else ARRAY_WORDS
    spoilt = mutate(good()[name], rng, JSON_WORDS if name.endswith(".json") else words)
    try:
        return lamp.seal({**good(), name: spoilt})
    except (ValueError, KeyError, TypeError, AttributeError):  # A manifest that is no longer one.
        return container.pack({**good(), name: spoilt})


def bundle_is_answered(data: bytes) -> bool:
    report = examine(data).report
    assert all(issue.message.isprintable() for issue in report.issues)
    report.to_json("x"), report.to_text("x")
    return report.valid


TARGETS = {
    "container": Target(make_archive, one_meaning, 0.3),
    "json": Target(make_json, json_as_others_read_it, 0.15),
    "manifest": Target(make_manifest, manifest_comes_back, 0.05),
    "npy": Target(make_array, array_as_large_as_it_says, 0.15),
    "onnx_bytes": Target(make_model, network_as_cheap_as_stated, 0.05),
    "onnx_graph": Target(make_graph, functools.partial(network_as_cheap_as_stated, run=True), 0.02),
    "onnx_drawn": Target(
        make_drawn_graph, functools.partial(network_as_cheap_as_stated, run=True), 0.03
    ),
    "onnx_heavy": Target(make_heavy_graph, network_as_fast_as_stated, 0.001),
    "onnx_compiled": Target(make_drawn_graph, network_as_soon_compiled_as_foretold, 0.0005),
    "layer": Target(make_layer, layer_is_answered, 0.25),
    "layer_usd": Target(make_layer, layer_opens_nothing_else, 0.003),
    "bundle": Target(make_bundle, bundle_is_answered, 0.002),
}
