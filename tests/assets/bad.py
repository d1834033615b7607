"""Bundles that break one rule each, made by code: for every issue code at least one."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from purelight_format.issues import FormatError
from purelight_format.limits import LIMITS
from purelight_format.members import container, npy
from purelight_format.usd import asset_layer
from tests.support import bundles, lamp

Asset = Callable[[], bytes]
Proto = onnx.ModelProto

ASSETS: dict[str, list[Asset]] = {}
BESIDE: dict[str, list[Asset]] = {}  # Makers of layers that lie beside the good lamp.
APPEARANCE = "networks/appearance.onnx"


def asset(code: str) -> Callable[[Asset], Asset]:
    """Registers a maker of a bundle that must be reported with this code and no other error."""

    def register(maker: Asset) -> Asset:
        ASSETS.setdefault(code, []).append(maker)
        return maker

    return register


# The container: bytes of the good bundle, patched


def sealed() -> bytearray:
    return bytearray(lamp.seal(lamp.good()))


def entry(data: bytes, name: str = "preview.png") -> container.Entry:
    return container.scan(bytes(data))[name]


def patched(offset: int, value: bytes, *, member: str = "preview.png") -> bytes:
    """Overwrites bytes of a local header."""
    data = sealed()
    start = entry(data, member).header + offset
    data[start : start + len(value)] = value
    return bytes(data)


def renamed(name: str) -> bytes:
    """The same archive with another name of the same length as preview.png."""
    old = b"preview.png"
    return bytes(sealed()).replace(old, name.encode("latin-1").ljust(len(old), b"x"))


def in_directory(offset: int, value: bytes) -> bytes:
    """Overwrites bytes of the last record of the central directory."""
    data = sealed()
    start = data.rindex(b"PK\1\2") + offset
    data[start : start + len(value)] = value
    return bytes(data)


def at_end(offset: int, value: bytes) -> bytes:
    data = sealed()
    start = len(data) - 22 + offset
    data[start : start + len(value)] = value
    return bytes(data)


asset("PLX_FILE_TOO_LARGE")(lambda: bytes(LIMITS.file_bytes + 1))
asset("PLX_ZIP_BAD_SIGNATURE")(lambda: b"")
asset("PLX_ZIP_BAD_SIGNATURE")(lambda: b"#usda 1.0\n" * 10)
asset("PLX_ZIP_HEADER_MISMATCH")(lambda: b"MZ" + bytes(sealed()))
asset("PLX_ZIP_TRUNCATED")(lambda: bytes(sealed()[:5000]))
asset("PLX_ZIP_TRUNCATED")(lambda: bytes(sealed()[:-1]))
asset("PLX_ZIP_TRAILING_DATA")(lambda: bytes(sealed()) + b"more")
asset("PLX_ZIP_COMMENT")(lambda: at_end(20, b"\4\0") + b"text")
asset("PLX_ZIP_ZIP64")(lambda: at_end(16, b"\xff" * 4))
asset("PLX_ZIP_ZIP64")(lambda: patched(18, b"\xff" * 8))
asset("PLX_ZIP_ENCRYPTED")(lambda: patched(6, b"\1"))
asset("PLX_ZIP_DATA_DESCRIPTOR")(lambda: patched(6, b"\x08"))
asset("PLX_ZIP_COMPRESSED")(lambda: patched(8, b"\x08"))
asset("PLX_ZIP_NOT_REGULAR")(lambda: in_directory(38, struct.pack("<I", 0o120777 << 16)))
asset("PLX_ZIP_NOT_CANONICAL")(lambda: patched(10, b"\1"))
asset("PLX_ZIP_NOT_CANONICAL")(lambda: patched(4, b"\x14"))
asset("PLX_ZIP_HEADER_MISMATCH")(lambda: in_directory(24, b"\1\0\0\0"))
asset("PLX_ZIP_HEADER_MISMATCH")(lambda: at_end(8, b"\1\0\1\0"))
asset("PLX_ZIP_HEADER_MISMATCH")(lambda: at_end(8, b"\1\0"))
asset("PLX_ZIP_HEADER_MISMATCH")(lambda: at_end(16, b"\1\0\0\0"))
asset("PLX_ZIP_HEADER_MISMATCH")(lambda: patched(18, b"\0\0\0\0"))
asset("PLX_ZIP_OVERLAP")(lambda: patched(18, b"\xff\xff\xff\0" * 2))
asset("PLX_ZIP_CRC")(lambda: patched(14, b"\0\0\0\0", member="preview.png").replace(
    *directory_crc()))  # fmt: skip
asset("PLX_ZIP_NAME_INVALID")(lambda: renamed("../evil.png"))
asset("PLX_ZIP_NAME_INVALID")(lambda: renamed("/etc/passwd"))
asset("PLX_ZIP_NAME_INVALID")(lambda: renamed("C:evil.png"))
asset("PLX_ZIP_NAME_INVALID")(lambda: renamed("Preview.png"))
asset("PLX_ZIP_NAME_INVALID")(lambda: renamed("a\0b.png"))
asset("PLX_ZIP_NAME_INVALID")(lambda: renamed("a/b/c/d/e.x"))
asset("PLX_ZIP_NAME_INVALID")(lambda: renamed(".hidden.png"))
asset("PLX_ZIP_NAME_DUPLICATE")(lambda: unchecked([("a", b""), ("a", b"")]))
asset("PLX_ZIP_NAME_DUPLICATE")(lambda: unchecked([("a", b""), ("a/b", b"")]))
asset("PLX_ZIP_NAME_DUPLICATE")(lambda: unchecked([("a/b", b""), ("a", b"")]))
asset("PLX_ZIP_TOO_MANY_MEMBERS")(lambda: unchecked([(f"m{k}", b"") for k in range(129)]))


def directory_crc() -> tuple[bytes, bytes]:
    """The CRC of preview.png and the one that is written over it."""
    return struct.pack("<I", entry(bytes(sealed())).crc), b"\0\0\0\0"


def unchecked(members: list[tuple[str, bytes]], gap: bytes = b"") -> bytes:
    """An archive without the writer's own checks."""
    data, entries = bytearray(), []
    for name, content in members:
        start = len(data) + 30 + len(name) + len(container._padding(len(data), name))
        item = container.Entry(name, len(data), start, len(content), 0)
        entries.append(item)
        data += container._local(item) + content
    data += gap
    directory = b"".join(map(container._central, entries))
    return bytes(data) + directory + container._end(len(entries), len(directory), len(data))


asset("PLX_ZIP_GAP")(lambda: unchecked([("a", b"")], gap=bytes(64)))


@asset("PLX_ZIP_GAP")
def hidden_bytes_in_the_padding() -> bytes:
    return patched(30 + len("preview.png") + 4, b"hidden")


@asset("PLX_ZIP_MISALIGNED")
def unpadded() -> bytes:
    data = unchecked([("a", b"")])
    start = 31 + int.from_bytes(data[28:30], "little")
    cut = data[:28] + b"\0\0" + data[30:31] + data[start:-22]
    return cut + container._end(1, 47, 31)


# The manifest


def manifest(text: bytes) -> bytes:
    """The good lamp with another manifest."""
    return container.pack({**lamp.good(), "manifest.json": text})


def edited(path: str, value: Any) -> bytes:
    """The good lamp with one field of its manifest changed; None removes it."""

    def edit(root: dict[str, Any]) -> None:
        *parents, last = path.split("/")
        for key in parents:
            root = root[key]
        if value is None:
            del root[last]
        else:
            root[last] = value

    return lamp.seal(lamp.good(), edit)


def listed(name: str, entry: Any, more: dict[str, bytes] | None = None) -> bytes:
    """The good lamp with another entry of the manifest for a member; None removes it."""

    def edit(root: dict[str, Any]) -> None:
        root["members"][name] = entry
        if entry is None:
            del root["members"][name]

    return lamp.seal({**lamp.good(), **(more or {})}, edit)


FINISH = {"name": "black", "base_color": [0.02, 0.02, 0.02]}


def finished(*made: dict[str, Any], sides: np.ndarray | None = None) -> bytes:
    """The good lamp with finishes, all of the first one unless said otherwise."""
    sides = np.zeros((8, 2), np.uint8) if sides is None else sides
    content = {**lamp.good(), "surface/finish.npy": npy.dumps(sides)}
    return lamp.seal(content, lambda root: root.update(finishes=list(made)))


def good_text() -> bytes:
    return lamp.good()["manifest.json"]


asset("PLX_JSON_TOO_LARGE")(lambda: manifest(b" " * (LIMITS.manifest_bytes + 1)))
asset("PLX_JSON_ENCODING")(lambda: manifest(b'{"name": "\xff"}'))
asset("PLX_JSON_ENCODING")(lambda: manifest(b"\xef\xbb\xbf{}"))
asset("PLX_JSON_ENCODING")(lambda: manifest(b'{"name": ["\\ud800"]}'))
asset("PLX_JSON_SYNTAX")(lambda: manifest(b"{"))
asset("PLX_JSON_SYNTAX")(lambda: manifest(b"{} {}"))
asset("PLX_JSON_DUPLICATE_KEY")(lambda: manifest(good_text().replace(b"{", b'{"r_max": 2,', 1)))
asset("PLX_JSON_NON_FINITE")(lambda: manifest(good_text().replace(b"15.0", b"NaN")))
asset("PLX_JSON_NON_FINITE")(lambda: manifest(good_text().replace(b"15.0", b"1e999")))
asset("PLX_JSON_NON_FINITE")(lambda: manifest(good_text().replace(b"15.0", b"9" * 5000)))
asset("PLX_JSON_TOO_DEEP")(lambda: manifest(b"[" * 100_000 + b"]" * 100_000))
asset("PLX_MANIFEST_MISSING")(lambda: container.pack({"a": b""}))
asset("PLX_MANIFEST_VERSION_UNSUPPORTED")(lambda: edited("format_version", "2.0"))
asset("PLX_MANIFEST_VERSION_NEWER")(lambda: edited("format_version", "1.1"))
asset("PLX_MANIFEST_SCHEMA")(lambda: manifest(b"[]"))
asset("PLX_MANIFEST_SCHEMA")(lambda: edited("format_version", "1.1\u0663"))
for _optional in ("tier", "provenance", "fidelity", "extensions", "finishes"):
    asset("PLX_MANIFEST_SCHEMA")(
        lambda key=_optional: lamp.seal(lamp.good(), lambda root: root.update({key: None}))
    )
for _path, _value in {
    "format_version": 1.0,
    "name": "two\nlines",
    "flux": [1, 2],
    "radiance_scale": "1",
    "r_max": True,
    "channels": [1, 1, 1],
    "provenance": [],
    "networks": [],
    "bounding_sphere/center": None,
    "networks/appearance/member": "networks/sampler.onnx",
    "networks/appearance/bytes": -1,
    "networks/sampler/uniform_fraction": 1.5,
    "members/preview.png/sha256": "ABC",
    "members/preview.png": 7,
}.items():
    asset("PLX_MANIFEST_SCHEMA")(lambda path=_path, value=_value: edited(path, value))
for _field, _wrong in {
    "name": "two\nlines",
    "base_color": [1, 1],
    "metalness": 2,
    "specular_color": [0, 0, -1],
    "roughness": "0.5",
    "ior": 0.5,
    "opacity": True,
    "thin_walled": 1,
    "back_exponent": -1,
}.items():
    asset("PLX_MANIFEST_SCHEMA")(lambda k=_field, v=_wrong: finished({**FINISH, k: v}))
asset("PLX_MANIFEST_SCHEMA")(lambda: edited("finishes", {"black": FINISH}))
asset("PLX_MANIFEST_SCHEMA")(lambda: edited("finishes", ["black"]))
asset("PLX_MANIFEST_FINISH_COUNT")(lambda: finished(*[FINISH] * (LIMITS.finishes + 1)))
asset("PLX_MANIFEST_FINISH_ENERGY")(
    lambda: finished({**FINISH, "scattered_back": [1, 0.5, 0.5]}))  # fmt: skip
asset("PLX_MANIFEST_MEMBER_MISSING")(lambda: edited("finishes", [FINISH]))
asset("PLX_SURFACE_FINISH")(lambda: finished(FINISH, sides=np.ones((8, 2), np.uint8)))
asset("PLX_NPY_SHAPE")(lambda: finished(FINISH, sides=np.zeros((8, 1), np.uint8)))
asset("PLX_NPY_TYPE")(lambda: finished(FINISH, sides=np.zeros((8, 2), np.uint32)))
asset("PLX_MANIFEST_UNKNOWN_FIELD")(lambda: finished({**FINISH, "mood": "cosy"}))
asset("PLX_MANIFEST_UNKNOWN_FIELD")(lambda: edited("mood", "cosy"))
asset("PLX_MANIFEST_UNITS")(lambda: edited("units/length", "cm"))
asset("PLX_MANIFEST_SPHERE_INVALID")(lambda: edited("bounding_sphere/radius", 0))
asset("PLX_MANIFEST_SPHERE_INVALID")(lambda: edited("bounding_sphere/center", [1e7, 0, 0]))
asset("PLX_MANIFEST_FLUX_INVALID")(lambda: edited("flux", [4, 2, -1]))
asset("PLX_MANIFEST_FLUX_INVALID")(lambda: edited("channels", [True, True, False]))
asset("PLX_MANIFEST_SCALE_INVALID")(lambda: edited("radiance_scale", 0))
for _tiny in (5e-324, 1e-39):  # Zero in float32, or where denormals are flushed.
    asset("PLX_MANIFEST_SPHERE_INVALID")(lambda x=_tiny: edited("bounding_sphere/radius", x))
    asset("PLX_MANIFEST_FLUX_INVALID")(lambda x=_tiny: edited("flux", [4, x, 1]))
    asset("PLX_MANIFEST_SCALE_INVALID")(lambda x=_tiny: edited("radiance_scale", x))
asset("PLX_MANIFEST_FLUX_INVALID")(lambda: edited("flux", [1e39, 2, 1]))
asset("PLX_MANIFEST_RMAX_INVALID")(lambda: edited("r_max", 1))
asset("PLX_MANIFEST_NETWORK_MISSING")(lambda: edited("networks", {}))
asset("PLX_MANIFEST_NETWORK_MISSING")(lambda: without_network("sampler_pdf"))
asset("PLX_MANIFEST_MEMBER_MISSING")(
    lambda: edited("members/lost.png", {"size": 0, "sha256": "0" * 64}))  # fmt: skip
asset("PLX_MANIFEST_MEMBER_MISSING")(lambda: without("surface/positions.npy"))
asset("PLX_MANIFEST_MEMBER_UNLISTED")(lambda: edited("members/preview.png", None))
asset("PLX_MANIFEST_DIGEST_MISMATCH")(lambda: edited("members/preview.png/sha256", "0" * 64))
asset("PLX_MANIFEST_DIGEST_MISMATCH")(lambda: edited("members/preview.png/size", 1))
asset("PLX_MANIFEST_COST_MISMATCH")(lambda: edited("networks/appearance/macs_per_sample", 1))


@asset("PLX_MANIFEST_NETWORK_UNKNOWN")
def a_network_of_the_future() -> bytes:
    cost = {"macs_per_sample": 1, "floats_per_sample": 1, "bytes": 1}
    return edited("networks/polarisation", {"member": "networks/polarisation.onnx", **cost})


asset("PLX_MANIFEST_VERDICT")(lambda: edited("fidelity/verdict", {"photons": "many"}))


@asset("PLX_MANIFEST_DARK")
@asset("PLX_GOLDEN_CHANNEL")
def a_lamp_that_is_switched_off() -> bytes:
    content = lamp.good()
    flux = np.zeros((8, 3), np.float32)
    content["surface/triangle_flux.npy"] = npy.dumps(flux)

    def edit(root: dict[str, Any]) -> None:
        root.update(flux=[0, 0, 0], channels=[False] * 3)

    return lamp.seal(content, edit)


def without(name: str) -> bytes:
    content = lamp.good()
    del content[name]
    return lamp.seal(content)


def without_network(network: str) -> bytes:
    content = {k: v for k, v in lamp.good().items() if f"/{network}." not in k}
    return lamp.seal(content, lambda root: root["networks"].pop(network))


# Networks


def network(change: Callable[[Proto], Any]) -> bytes:
    """The good lamp with a changed appearance network."""
    proto = lamp.appearance()
    change(proto)
    return with_network(proto.SerializeToString())


def member_of(data: bytes, name: str) -> bytes:
    """A member of a bundle."""
    return bytes(container.member(data, container.scan(data)[name]))


def with_network(data: bytes, content: dict[str, bytes] | None = None) -> bytes:
    """The good lamp, or other members, with another appearance network."""

    def edit(root: dict[str, Any]) -> None:
        stated = root["networks"]["appearance"]
        stated["bytes"] = len(data)
        with suppress(FormatError):  # So that the only fault of a sound network is another one.
            stated.update(asdict(bundles.info("appearance", data)))
            del stated["uniform_fraction"], stated["extra"]

    return lamp.seal({**(content or lamp.good()), APPEARANCE: data}, edit)


def nodes(*made: onnx.NodeProto, **constants: Any) -> bytes:
    """The good lamp with more nodes in front of its appearance network."""

    def change(proto: Proto) -> None:
        kept = list(proto.graph.node)
        del proto.graph.node[:]
        proto.graph.node.extend([*made, *kept])
        tensors = [numpy_helper.from_array(np.asarray(v), k) for k, v in constants.items()]
        proto.graph.initializer.extend(tensors)

    return network(change)


def one(op: str, inputs: str = "position", outputs: str = "z", **attributes: Any) -> Any:
    return helper.make_node(op, inputs.split(), outputs.split(), **attributes)


def set_field(name: str, value: Any, index: int = 0) -> bytes:
    """A field of an initializer of the appearance network is changed."""

    def change(proto: Proto) -> None:
        setattr(proto.graph.initializer[index], name, value)

    return network(change)


EYE = np.eye(3, dtype=np.float32)
ONES = np.ones(3, np.float32)

asset("PLX_ONNX_TOO_LARGE")(
    lambda: nodes(*(one("Identity", outputs=f"z{k}") for k in range(LIMITS.nodes)))
)
asset("PLX_ONNX_TOO_LARGE")(lambda: nodes(**{f"c{k}": ONES for k in range(LIMITS.initializers)}))
asset("PLX_ONNX_PARSE")(lambda: with_network(b"\xff" * 100))
asset("PLX_ONNX_PARSE")(lambda: with_network(b""))
asset("PLX_ONNX_PARSE")(lambda: with_network(b"ORTM" + bytes(60)))
asset("PLX_ONNX_IR_VERSION")(lambda: network(lambda p: setattr(p, "ir_version", 9)))
asset("PLX_ONNX_OPSET")(lambda: network(lambda p: setattr(p.opset_import[0], "version", 17)))
asset("PLX_ONNX_OPSET")(lambda: network(lambda p: p.opset_import.add(version=18)))
asset("PLX_ONNX_FOREIGN_DOMAIN")(
    lambda: network(lambda p: p.opset_import.add(domain="com.microsoft", version=1))
)
asset("PLX_ONNX_FOREIGN_DOMAIN")(lambda: nodes(one("Relu", domain="com.microsoft")))
asset("PLX_ONNX_FEATURE")(lambda: network(lambda p: p.functions.add(name="f")))
asset("PLX_ONNX_FEATURE")(lambda: network(lambda p: p.training_info.add()))
asset("PLX_ONNX_FEATURE")(lambda: network(lambda p: p.graph.sparse_initializer.add()))
asset("PLX_ONNX_FEATURE")(lambda: network(lambda p: p.graph.value_info.add(name="h0")))
asset("PLX_ONNX_EXTERNAL_DATA")(lambda: set_field("data_location", TensorProto.EXTERNAL))
asset("PLX_ONNX_EXTERNAL_DATA")(
    lambda: network(
        lambda p: p.graph.initializer[0].external_data.add(key="location", value="../secret")
    )
)
asset("PLX_ONNX_TENSOR_TYPE")(lambda: nodes(c=np.zeros(1, np.float64)))
asset("PLX_ONNX_TENSOR_TYPE")(lambda: set_field("data_type", TensorProto.STRING))
asset("PLX_ONNX_TENSOR_DATA")(lambda: set_field("raw_data", b"\0" * 4))
for _size in (1 << 62, -1, 0):
    asset("PLX_ONNX_TENSOR_DATA")(
        lambda size=_size: network(lambda p: p.graph.initializer[0].dims.append(size))
    )
asset("PLX_ONNX_TENSOR_DATA")(
    lambda: network(lambda p: p.graph.initializer[0].float_data.append(1.0))
)
asset("PLX_ONNX_NON_FINITE_WEIGHT")(lambda: nodes(c=np.array([1, np.nan], np.float32)))
asset("PLX_ONNX_NON_FINITE_WEIGHT")(lambda: nodes(c=np.array([-np.inf], np.float32)))
asset("PLX_ONNX_DUPLICATE_NAME")(lambda: nodes(w0=ONES))
asset("PLX_ONNX_DUPLICATE_NAME")(lambda: nodes(position=ONES))
asset("PLX_ONNX_DUPLICATE_NAME")(
    lambda: nodes(one("Relu", name="twice"), one("Relu", outputs="y0", name="twice"))
)
asset("PLX_ONNX_DUPLICATE_NAME")(lambda: nodes(one("Relu", outputs="h0")))
asset("PLX_ONNX_NAME_INVALID")(lambda: nodes(helper.make_node("Relu", ["position"], [""])))
asset("PLX_ONNX_NAME_INVALID")(lambda: nodes(helper.make_node("Relu", ["position"], ["\n"])))
asset("PLX_ONNX_NAME_INVALID")(
    lambda: with_network(lamp.appearance().SerializeToString().replace(b"h0", b"\xff0"))
)
asset("PLX_ONNX_NAME_INVALID")(
    lambda: network(lambda p: setattr(p.graph.node[0], "name", "\x1b[2J"))
)
asset("PLX_ONNX_UNDEFINED_NAME")(lambda: nodes(one("Relu", "h0")))
asset("PLX_ONNX_UNDEFINED_NAME")(lambda: network(lambda p: p.graph.node.pop()))
asset("PLX_ONNX_IO_SIGNATURE")(
    lambda: network(lambda p: setattr(p.graph.input[0], "name", "location"))
)
asset("PLX_ONNX_IO_SIGNATURE")(lambda: network(lambda p: p.graph.input.pop()))
asset("PLX_ONNX_IO_SIGNATURE")(
    lambda: network(lambda p: setattr(p.graph.output[0].type.tensor_type, "elem_type", 11))
)
asset("PLX_ONNX_IO_SIGNATURE")(
    lambda: network(
        lambda p: setattr(p.graph.input[0].type.tensor_type.shape.dim[0], "dim_param", "batch")
    )
)


@asset("PLX_ONNX_IO_SIGNATURE")
def an_output_of_another_width() -> bytes:
    def change(proto: Proto) -> None:
        proto.graph.node[-1].input[0] = "h1"

    return network(change)


@asset("PLX_ONNX_SUBGRAPH")
def a_graph_in_an_attribute() -> bytes:
    node = one("Relu")
    node.attribute.add(name="body", type=onnx.AttributeProto.GRAPH).g.name = "inner"
    return nodes(node)


for _op in ("Loop", "If", "Scan", "ConstantOfShape", "Expand", "Tile", "Range", "Shape", "Pow",
            "NonZero", "BitwiseXor", "RandomNormal", "Constant", "Einsum"):  # fmt: skip
    asset("PLX_ONNX_OP_NOT_ALLOWED")(lambda op=_op: nodes(one(op)))

asset("PLX_ONNX_ATTRIBUTE")(lambda: nodes(one("Relu", alpha=1.0)))
asset("PLX_ONNX_ATTRIBUTE")(lambda: nodes(one("Concat", axis=1.0)))
asset("PLX_ONNX_ATTRIBUTE")(
    lambda: nodes(one("ReduceSum", "position a", keepdims=-1), a=np.array([1]))
)
asset("PLX_ONNX_ATTRIBUTE")(lambda: nodes(one("Relu", "position normal")))
asset("PLX_ONNX_ATTRIBUTE")(lambda: nodes(one("Relu", outputs="z0 z1")))
asset("PLX_ONNX_ATTRIBUTE")(lambda: nodes(one("Transpose", perm=[0, 1] * 10)))

for _node, _constants in (
    (one("Relu", "c"), {"c": ONES}),
    (one("Concat", "position position", axis=0), {}),
    (one("Softmax", axis=0), {}),
    (one("Softmax", axis=2), {}),
    (one("ReduceSum", "position a"), {"a": np.array([0])}),
    (one("ReduceSum", "position a"), {"a": np.array([-2])}),
    (one("ReduceMax", "position a"), {"a": np.array([5])}),
    (one("CumSum", "position a"), {"a": np.array(0)}),
    (one("Transpose", perm=[1, 0]), {}),
    (one("Reshape", "position s"), {"s": np.array([3, -1])}),
    (one("Reshape", "position s"), {"s": np.array([-1, 4])}),
    (one("Reshape", "position s"), {"s": np.array([-1, -1])}),
    (one("Add", "position c"), {"c": np.ones((4, 3), np.float32)}),
    (one("Add", "position c"), {"c": np.ones((1, 1, 3), np.float32)}),
    (one("Add", "position c"), {"c": np.ones(2, np.float32)}),
    (one("MatMul", "position normal"), {}),
    (one("MatMul", "position c"), {"c": np.ones((4, 3), np.float32)}),
    (one("Gemm", "position c b", transB=0), {"c": EYE, "b": ONES}),
    (one("Gemm", "position c b", transB=1, alpha=2.0), {"c": EYE, "b": ONES}),
    (one("Gemm", "position c b", transB=1), {"c": EYE, "b": np.ones(2, np.float32)}),
    (one("Split", "position s", "a b", axis=1), {"s": np.array([1, 1])}),
    (one("Split", "position s", "a b c", axis=0), {"s": np.array([1, 1, 1])}),
    (one("Slice", "position s e a"), {"s": np.array([0]), "e": np.array([1]), "a": np.array([0])}),
    (one("Slice", "position s e a"), {"s": np.array([2]), "e": np.array([1]), "a": np.array([1])}),
    (one("Squeeze", "position a"), {"a": np.array([1])}),
    (one("Squeeze", "position a"), {"a": np.array([0])}),
    (one("Unsqueeze", "position a"), {"a": np.array([0])}),
    (one("Unsqueeze", "position a"), {"a": np.array([1, 1])}),
    (one("Gather", "position i", axis=1), {"i": np.array([3])}),
    (one("Gather", "position i", axis=0), {"i": np.array([0])}),
    (one("Clip", "position c"), {"c": ONES}),
    (one("ReduceSum", "position a"), {"a": np.array([1, -1])}),
    (one("Squeeze", "position a"), {"a": np.array([1, 1])}),
    (
        one("Slice", "position s e a"),
        {"s": np.zeros(2, int), "e": np.ones(2, int), "a": np.array([1, -1])},
    ),
    (one("Where", "position position position"), {}),
):
    _code = "PLX_ONNX_TYPE" if _node.op_type == "Where" else "PLX_ONNX_SHAPE"
    asset(_code)(lambda node=_node, constants=_constants: nodes(node, **constants))

asset("PLX_ONNX_TYPE")(lambda: nodes(one("And", "position position")))
asset("PLX_ONNX_TYPE")(lambda: nodes(one("Add", "position c"), c=np.array([1])))
asset("PLX_ONNX_TYPE")(lambda: nodes(one("Cast", to=TensorProto.FLOAT16)))
asset("PLX_ONNX_TYPE")(lambda: nodes(one("Mod", "position normal")))
asset("PLX_ONNX_TYPE")(lambda: nodes(one("GatherElements", "position normal", axis=1)))
asset("PLX_ONNX_TYPE")(
    lambda: nodes(one("Cast", outputs="b", to=TensorProto.BOOL), one("Where", "b b b"))
)
asset("PLX_ONNX_TYPE")(
    lambda: nodes(
        one("Slice", "position s e a"), s=np.zeros(1, "i4"), e=np.ones(1, "i4"), a=np.ones(1, "i8")
    )
)


@asset("PLX_ONNX_SHAPE")
def an_index_of_fewer_rows_than_its_data() -> bytes:
    """NumPy spreads it over the data's 65,536 rows, where the profile foretells one."""
    return nodes(
        one("Unsqueeze", "position a", "u"), one("Gather", "u many", "x", axis=1),
        one("Cast", "u", "i", to=TensorProto.INT64), one("GatherElements", "x i", "j", axis=2),
        a=np.array([1]), many=np.zeros(LIMITS.sample_floats // 3, np.int64),
    )  # fmt: skip


@asset("PLX_ONNX_ATTRIBUTE")
def an_attribute_of_two_values() -> bytes:
    made = one("Softmax", axis=1)
    made.attribute[0].f = 1.0
    return nodes(made)


@asset("PLX_ONNX_COST")
def doubling_by_concatenation() -> bytes:
    chain = [one("Concat", "position position", "z0", axis=1)]
    chain += [one("Concat", f"z{k} z{k}", f"z{k + 1}", axis=1) for k in range(28)]
    return nodes(*chain)


@asset("PLX_ONNX_COST")
def many_wide_layers() -> bytes:
    widen = np.zeros((4096, 3), np.float32)
    chain = [one("Gemm", "position w c", "z0", transB=1)]
    chain += [one("Relu", f"z{k}", f"z{k + 1}") for k in range(300)]
    return nodes(*chain, w=widen, c=np.zeros(4096, np.float32))


@asset("PLX_ONNX_COST")
def a_product_too_large() -> bytes:
    first, second = np.zeros((2048, 3), np.float32), np.zeros((2048, 2048), np.float32)
    bias = np.zeros(2048, np.float32)
    chain = [one("Gemm", "position w c", "z0", transB=1)]
    chain += [one("Gemm", f"z{k} v c", f"z{k + 1}", transB=1) for k in range(4)]
    return nodes(*chain, w=first, v=second, c=bias)


asset("PLX_ONNX_UNUSED_INITIALIZER")(lambda: nodes(unused=ONES))
asset("PLX_ONNX_METADATA")(lambda: network(lambda p: setattr(p, "doc_string", "/home/me/net.py")))
asset("PLX_ONNX_METADATA")(
    lambda: network(lambda p: p.graph.node[0].metadata_props.add(key="trace", value="net.py"))
)


# Arrays


def member(name: str, data: bytes) -> bytes:
    return lamp.seal({**lamp.good(), name: data})


def array(name: str, value: Any, dtype: str = "<f4") -> bytes:
    return member(name, npy.dumps(np.asarray(value, dtype)))


POSITIONS, TRIANGLES = "surface/positions.npy", "surface/triangles.npy"
FLUX = "surface/triangle_flux.npy"


def header(text: bytes, data: bytes = bytes(72)) -> bytes:
    """The positions behind another header."""
    fill = -(10 + len(text) + 1) % 64
    start = npy.MAGIC + (len(text) + fill + 1).to_bytes(2, "little")
    return member(POSITIONS, start + text + b" " * fill + b"\n" + data)


asset("PLX_NPY_HEADER")(lambda: member(POSITIONS, b"no array"))
asset("PLX_NPY_HEADER")(lambda: member(POSITIONS, npy.MAGIC + b"\xff\xff" + bytes(100)))
asset("PLX_NPY_HEADER")(
    lambda: header(b"{'descr': '<f4', 'fortran_order': True, 'shape': (6, 3), }")
)
asset("PLX_NPY_HEADER")(
    lambda: header(b"{'descr': '|O', 'fortran_order': False, 'shape': (6, 3), }")
)
asset("PLX_NPY_HEADER")(
    lambda: header(b"{'descr': '<f4', 'fortran_order': False, 'shape': (06, 3), }")
)
asset("PLX_NPY_SIZE")(
    lambda: header(b"{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999, 3), }")
)
asset("PLX_NPY_TYPE")(lambda: array(POSITIONS, np.zeros((6, 3)), "<f8"))
asset("PLX_NPY_SHAPE")(lambda: array(POSITIONS, np.zeros((6, 2))))
asset("PLX_NPY_SHAPE")(lambda: array(POSITIONS, np.zeros(18)))
asset("PLX_NPY_SHAPE")(lambda: array(FLUX, np.zeros((7, 3))))
asset("PLX_NPY_TOO_LARGE")(lambda: member(POSITIONS, bytes(LIMITS.array_bytes + 1)))
asset("PLX_NPY_NON_FINITE")(lambda: array(POSITIONS, np.full((6, 3), np.nan)))
asset("PLX_SURFACE_INDEX")(lambda: array(TRIANGLES, np.full((8, 3), 6), "<u4"))
asset("PLX_SURFACE_FLUX")(lambda: array(FLUX, np.full((8, 3), -1)))
asset("PLX_SURFACE_OUTSIDE_SPHERE")(lambda: array(POSITIONS, np.full((6, 3), 7)))
asset("PLX_SURFACE_FLUX_CLOSURE")(lambda: array(FLUX, np.full((8, 3), 0.5)))


@asset("PLX_SURFACE_CROWDED")
def copies_of_a_triangle() -> bytes:
    return crowd(np.tile(np.arange(3), (12_000, 1)))


def crowd(triangles: np.ndarray) -> bytes:
    """The good lamp with other triangles over its vertices."""
    flux = np.tile(np.array(lamp.FLUX) / len(triangles), (len(triangles), 1))
    content = lamp.good() | {TRIANGLES: npy.dumps(triangles.astype("<u4"))}
    return lamp.seal(content | {FLUX: npy.dumps(flux.astype("<f4"))})


@asset("PLX_SURFACE_EMPTY")
def no_triangles() -> bytes:
    content = lamp.good()
    content[TRIANGLES] = npy.dumps(np.zeros((0, 3), "<u4"))
    content[FLUX] = npy.dumps(np.zeros((0, 3), "<f4"))
    return lamp.seal(content)


# The USD layer


def layer(old: str, new: str) -> bytes:
    """The good lamp with a text in its layer replaced."""
    content = lamp.good()
    name = next(iter(content))
    text = content[name].decode()
    assert old in text
    return lamp.seal({**content, name: text.replace(old, new, 1).encode()})


asset("PLX_USD_NOT_FIRST")(lambda: lamp.seal(dict(reversed(lamp.good().items()))))
asset("PLX_USD_NOT_FIRST")(lambda: member("extensions/more.usdc", b""))


@asset("PLX_USD_NOT_FIRST")
def a_layer_in_a_folder() -> bytes:
    (first, text), *others = lamp.good().items()
    return lamp.seal({f"folder/{first}": text, **dict(others)})


asset("PLX_USD_SYNTAX")(lambda: layer("#usda 1.0", "#usda 2.0"))
asset("PLX_USD_SYNTAX")(lambda: layer('"Z"', '"Z'))
asset("PLX_USD_SYNTAX")(lambda: layer("@./manifest.json@", "@./manifest.json"))
asset("PLX_USD_NO_DEFAULT_PRIM")(lambda: layer('defaultPrim = "octahedron"', ""))
asset("PLX_USD_NO_DEFAULT_PRIM")(lambda: layer('defaultPrim = "octahedron"', 'defaultPrim = "a"'))
asset("PLX_USD_SCHEMA_MISSING")(lambda: layer('"PureLightLuminaireAPI", ', ""))
asset("PLX_USD_PATH")(lambda: layer("@./manifest.json@", "@/etc/passwd@"))
asset("PLX_USD_PATH")(lambda: layer("@./manifest.json@", "@./../secret.json@"))
asset("PLX_USD_PATH")(lambda: layer("@./manifest.json@", "@manifest.json@"))
asset("PLX_USD_PATH")(lambda: layer("@./manifest.json@", "@http://host/x@"))
asset("PLX_USD_NOT_ALLOWED")(lambda: layer("kind =", "instanceable = 1\n    kind ="))
asset("PLX_USD_TOO_DEEP")(lambda: layer("    kind =", "customData = " + "{ dictionary a = " * 16
                                        + "{}" + "}" * 16 + "\n    kind ="))  # fmt: skip
asset("PLX_USD_PATH_DANGLING")(lambda: layer("@./manifest.json@", "@./other.json@"))
asset("PLX_USD_REFERENCES_LAYER")(lambda: layer("@./manifest.json@", "@./outside.usda@"))
asset("PLX_USD_METERS_PER_UNIT")(lambda: layer("metersPerUnit = 1", "metersPerUnit = 0.01"))
asset("PLX_USD_METERS_PER_UNIT")(lambda: layer('upAxis = "Z"', 'upAxis = "Y"'))


# The layer beside a bundle


def side_digest() -> str:
    """The digest of the good lamp."""
    return hashlib.sha256(lamp.good()["manifest.json"]).hexdigest()


def side_text() -> str:
    """The layer that belongs beside the good lamp as lamp.plux."""
    paths = asset_layer.Paths("./lamp.plux", "./lamp.usda", side_digest())
    return asset_layer.layer_text(lamp.parts()[0], lamp.surface(), paths)


# Golden vectors, pictures and others

RADIANCE = "vectors/appearance.radiance"


def golden(name: str, change: Callable[[np.ndarray], np.ndarray]) -> bytes:
    data = lamp.good()[name]
    return member(name, npy.dumps(change(npy.loads(data, name, "<f8").copy())))


@asset("PLX_GOLDEN_MISSING")
def no_vectors() -> bytes:
    content = lamp.good()
    return lamp.seal({k: v for k, v in content.items() if "vectors/appearance." not in k})


@asset("PLX_GOLDEN_SHAPE")
def no_vector() -> bytes:
    content = lamp.good()
    for name in content:
        if name.startswith("vectors/transparency."):
            dtype = "<f8" if "transmittance" in name else "<f4"
            content[name] = npy.dumps(np.zeros((0, 3), dtype))
    return lamp.seal(content)


asset("PLX_GOLDEN_TOLERANCE_INVALID")(lambda: golden(f"{RADIANCE}.tolerance.npy", np.negative))
asset("PLX_GOLDEN_TOLERANCE_LOOSE")(lambda: golden(f"{RADIANCE}.tolerance.npy", lambda t: t + 1e3))
asset("PLX_GOLDEN_MISMATCH")(lambda: golden(f"{RADIANCE}.npy", lambda y: 2 * y))
asset("PLX_GOLDEN_RANGE")(lambda: golden(f"{RADIANCE}.npy", np.negative))


@asset("PLX_GOLDEN_BROKEN")
def an_index_beyond_its_table() -> bytes:
    return nodes(
        one("Cast", to=TensorProto.INT64, outputs="i"), one("Add", "i far", "j"),
        one("Gather", "c j"), far=np.array([1000]), c=ONES,
    )  # fmt: skip


asset("PLX_PREVIEW_INVALID")(lambda: member("preview.png", b"GIF89a"))
asset("PLX_PHOTOMETRY_INVALID")(lambda: member("photometry.ies", b"<html>"))
asset("PLX_MEMBER_UNKNOWN")(lambda: member("networks/extra.onnx", b""))
asset("PLX_MEMBER_TOO_LARGE")(lambda: member("preview.png", bytes(LIMITS.picture_bytes + 1)))
