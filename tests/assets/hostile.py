"""Abuses of the format that were tried, each as a bundle that must be refused with its code.

Every one of them is a row of spec/ATTACKS.md.
"""

from __future__ import annotations

import io
import json
import pickle
import struct
import zipfile
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import onnx
from onnx import TensorProto, helper

from purelight_format.limits import LIMITS
from purelight_format.members import container, npy
from tests.assets import bad
from tests.assets.bad import APPEARANCE, Asset, asset, edited, layer, manifest, network, nodes, one
from tests.support import lamp


class Attack(NamedTuple):
    """A row of the page: what was tried, and what stopped it."""

    kind: str
    abuse: str
    defence: str
    code: str


ATTACKS: list[Attack] = []


def attack(kind: str, abuse: str, defence: str, code: str) -> Callable[[Asset], Asset]:
    """Registers a hostile bundle."""
    ATTACKS.append(Attack(kind, abuse, defence, code))
    return asset(code)


# Zip: two readers, two meanings

ZIP = "Zip"
WALK = "one walk over every byte, from the first to the last"
REPEAT = "the directory must repeat the local headers"
CANON = "every field has one value"
ALPHABET = "an alphabet of names without roots, drives, dots or case"


@attack(ZIP, "two members that share their bytes (CVE-2024-0450)", WALK, "PLX_ZIP_OVERLAP")
def overlapping_members() -> bytes:
    data = bytearray(bad.unchecked([("a", bytes(64)), ("b", b"")]))
    data[18:26] = struct.pack("<2I", 160, 160)  # The first reaches over the second's header.
    return bytes(data)


@attack(ZIP, "a bomb: 50 MB of zeros in 49 kB", "members are stored", "PLX_ZIP_COMPRESSED")
def deflated_zeros() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("a.usda"), bytes(50_000_000), zipfile.ZIP_DEFLATED)
    return file.getvalue()


@attack(ZIP, "an archive of Python's zipfile with `../../evil`", CANON, "PLX_ZIP_NOT_CANONICAL")
def another_writers_traversal() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("../../evil", b"")
    return file.getvalue()


for _name in (
    "../evil.png",
    "..\\evil.png",
    "//host/a",
    "nul:stream",
    "a/../b.png",
    "CON.png",
    "con.png",
    "folder/com1",
    "nul.png",
    "-o.png0",
    "previewpng.",
    "a\x1b[2Jb",
):
    attack(ZIP, f"a member named {_name!r}", ALPHABET, "PLX_ZIP_NAME_INVALID")(
        lambda name=_name: bad.renamed(name)
    )
attack(
    ZIP, "a name in other bytes that looks the same (`prevіew`)", ALPHABET, "PLX_ZIP_NAME_INVALID"
)(lambda: bad.renamed("prev\xd1\x96ew"))
attack(ZIP, "the flag that says names are UTF-8", CANON, "PLX_ZIP_NOT_CANONICAL")(
    lambda: bad.patched(6, b"\0\x08")
)
attack(ZIP, "a directory that names a member otherwise than its header", REPEAT,
       "PLX_ZIP_HEADER_MISMATCH")(lambda: bad.in_directory(46, b"z"))  # fmt: skip
attack(ZIP, "a directory that gives a member another place", REPEAT, "PLX_ZIP_HEADER_MISMATCH")(
    lambda: bad.in_directory(42, b"\0\0\0\0")
)
attack(ZIP, "a directory record with an extra field", REPEAT, "PLX_ZIP_HEADER_MISMATCH")(
    lambda: bad.in_directory(30, b"\4\0")
)
attack(ZIP, "strong encryption announced by flag 6", CANON, "PLX_ZIP_NOT_CANONICAL")(
    lambda: bad.patched(6, b"\x40")
)
attack(ZIP, "AES encryption as method 99", "members are stored", "PLX_ZIP_COMPRESSED")(
    lambda: bad.patched(8, b"\x63")
)


def prepended(start: bytes) -> bytes:
    """The good lamp behind other bytes, with every offset corrected as a self-extractor does."""
    data = bad.sealed()
    shift = len(start)
    _, *_, size, offset, _ = container.END.unpack(data[-22:])
    at = offset
    while at < offset + size:
        name = int.from_bytes(data[at + 28 : at + 30], "little")
        header = int.from_bytes(data[at + 42 : at + 46], "little")
        data[at + 42 : at + 46] = (header + shift).to_bytes(4, "little")
        at += 46 + name
    data[-6:-2] = (offset + shift).to_bytes(4, "little")
    return start + bytes(data)


attack(ZIP, "a program in front of the archive, offsets corrected", WALK, "PLX_ZIP_BAD_SIGNATURE")(
    lambda: prepended(b"MZ" + bytes(62))
)
attack(ZIP, "a picture in front of the archive, offsets corrected", WALK, "PLX_ZIP_BAD_SIGNATURE")(
    lambda: prepended(lamp.PNG)
)
attack(
    ZIP,
    "a second archive behind the first",
    "one end record, at the end",
    "PLX_ZIP_HEADER_MISMATCH",
)(lambda: bytes(bad.sealed()) * 2)
attack(
    ZIP, "a second archive in the comment of the first", "no comment", "PLX_ZIP_HEADER_MISMATCH"
)(lambda: bad.at_end(20, struct.pack("<H", len(container.pack({})))) + container.pack({}))


def extra_field(kind: int, content: bytes) -> bytes:
    """One empty member with an extra field of another kind that aligns its data as well."""
    size = container.ALIGNMENT - 31
    field = struct.pack("<2H", kind, size - 4) + content.ljust(size - 4, b"\0")
    entry = container.Entry("a", 0, 64, 0, 0)
    local = bytearray(container._local(entry))
    local[31:] = field
    return bytes(local) + container._central(entry) + container._end(1, 47, 64)


attack(ZIP, "zip64 sizes in an extra field", "the extra field is padding", "PLX_ZIP_GAP")(
    lambda: extra_field(1, struct.pack("<2Q", 1 << 40, 1 << 40))
)
attack(ZIP, "another name in a Unicode path field", "the extra field is padding", "PLX_ZIP_GAP")(
    lambda: extra_field(0x7075, b"\1\0\0\0\0../evil")
)
attack(ZIP, "65,535 members", "members are counted while walking", "PLX_ZIP_ZIP64")(
    lambda: bad.unchecked([(f"m{k}", b"") for k in range(65535)])
)
attack(ZIP, "20,000 members", "members are counted while walking", "PLX_ZIP_TOO_MANY_MEMBERS")(
    lambda: bad.unchecked([(f"m{k}", b"") for k in range(20_000)])
)


# JSON: little text, much work

JSON = "JSON"
ONCE = "one pass, keys counted in a table"
BOUNDED = "a report keeps its first hundred issues and cuts long texts"


def with_field(key: str, value: Any) -> bytes:
    return manifest(json.dumps({**json.loads(bad.good_text()), key: value}).encode())


def many(count: int) -> dict[str, int]:
    return {str(k): 0 for k in range(count)}


@attack(JSON, "80,000 keys and the last one twice, quadratic in a naive search", ONCE,
        "PLX_JSON_DUPLICATE_KEY")  # fmt: skip
def many_keys() -> bytes:
    return manifest(json.dumps(many(80_000)).encode()[:-1] + b',"79999":1}')


attack(JSON, "a key twice deep in a free field", ONCE, "PLX_JSON_DUPLICATE_KEY")(
    lambda: manifest(bad.good_text().replace(b'"seed"', b'"scene": 1, "seed"'))
)
attack(JSON, "a key twice, once by an escape", ONCE, "PLX_JSON_DUPLICATE_KEY")(
    lambda: manifest(bad.good_text().replace(b'"r_max"', b'"\\u0072_max": 2, "r_max"', 1))
)
attack(JSON, "a key of 100 kB with 50,000 unknown fields: 5 GB of locations", BOUNDED,
       "PLX_MANIFEST_SCHEMA")(
    lambda: with_field("members", {"k" * 100_000: many(50_000)})
)  # fmt: skip
attack(JSON, "50,000 members that are none", BOUNDED, "PLX_MANIFEST_SCHEMA")(
    lambda: with_field("members", many(50_000))
)
attack(JSON, "60,000 unknown fields", BOUNDED, "PLX_MANIFEST_UNKNOWN_FIELD")(
    lambda: manifest(
        json.dumps({**json.loads(lamp.good()["manifest.json"]), **many(60_000)}).encode()
    )
)
for _text in ("Infinity", "-Infinity", "-1e999", "1e308e5"):
    attack(JSON, f"the number {_text}", "numbers are finite and short",
           "PLX_JSON_SYNTAX" if "e5" in _text else "PLX_JSON_NON_FINITE")(
        lambda text=_text: manifest(bad.good_text().replace(b"15.0", text.encode()))
    )  # fmt: skip
attack(JSON, "objects nested 100,000 deep", "depth is counted before parsing", "PLX_JSON_TOO_DEEP")(
    lambda: manifest(b'{"a":' * 100_000 + b"0" + b"}" * 100_000)
)
attack(
    JSON, "a lone surrogate as a key", "text must be UTF-8 after unescaping", "PLX_JSON_ENCODING"
)(lambda: manifest(b'{"\\udc80": 1}'))
attack(JSON, "UTF-16", "text must be UTF-8", "PLX_JSON_ENCODING")(
    lambda: manifest(bad.good_text().decode().encode("utf-16"))
)
attack(JSON, "a number of 40 digits as a size", "counts end at 2⁵³", "PLX_MANIFEST_SCHEMA")(
    lambda: edited("networks/appearance/bytes", 10**39)
)
for _name in ("\x1b[2J\x1b]0;owned\x07", "lamp\u202egnp.exe", "lamp\nINVALID"):
    attack(JSON, f"a lamp named {_name!a}, for the terminal that shows it", "names are printable",
           "PLX_MANIFEST_SCHEMA")(lambda name=_name: edited("name", name))  # fmt: skip


# ONNX: graphs that cost or escape

ONNX = "ONNX"
BYTES = "weights lie in the model; sessions are made from bytes"
WALKED = "our own walk knows each shape before anything runs"
DIVISORS = "integers are divided by positive constants"
STEPPED = "fields are counted on the bytes before protobuf parses them"


def external(location: str, **more: str) -> bytes:
    def change(proto: onnx.ModelProto) -> None:
        tensor = proto.graph.initializer[0]
        tensor.data_location = TensorProto.EXTERNAL
        for key, value in {"location": location, **more}.items():
            tensor.external_data.add(key=key, value=value)

    return network(change)


for _place in ("/etc/passwd", "a/../../secret", "*/_ORT_MEM_ADDR_/*", "file:///etc/passwd"):
    attack(ONNX, f"weights at `{_place}`", BYTES, "PLX_ONNX_EXTERNAL_DATA")(
        lambda place=_place: external(place, offset="0", length="4")
    )


def loop() -> onnx.NodeProto:
    """A node whose body is a graph."""
    node = one("Loop", "position", "z")
    node.attribute.add(name="body", type=onnx.AttributeProto.GRAPH).g.name = "forever"
    return node


def refused(kind: str, abuse: str, defence: str, code: str, *made: Any, **constants: Any) -> None:
    attack(kind, abuse, defence, code)(lambda: nodes(*made, **constants))


@attack(ONNX, "a Loop of 2⁶² turns", "a list of 45 operators", "PLX_ONNX_OP_NOT_ALLOWED")
def endless_loop() -> bytes:
    return nodes(loop())


@attack(ONNX, "a graph in an attribute of an allowed operator", "attributes are numbers",
        "PLX_ONNX_SUBGRAPH")  # fmt: skip
def graphs_in_attribute() -> bytes:
    node = one("Softmax")
    node.attribute.add(name="axis", type=onnx.AttributeProto.GRAPHS).graphs.add(name="inner")
    return nodes(node)


@attack(ONNX, "a local function that calls itself", "no local functions", "PLX_ONNX_FEATURE")
def recursive_function() -> bytes:
    def change(proto: onnx.ModelProto) -> None:
        call = helper.make_node("f", ["x"], ["y"], domain="mine")
        proto.functions.add(name="f", domain="mine", input=["x"], output=["y"]).node.append(call)

    return network(change)


@attack(ONNX, "a function in the place of an operator (overload)", "no local functions",
        "PLX_ONNX_OP_NOT_ALLOWED")  # fmt: skip
def overloaded() -> bytes:
    node = one("Relu")
    node.overload = "mine"
    return nodes(node)


refused(ONNX, "an operator of ONNX Runtime's own domain", "one domain", "PLX_ONNX_FOREIGN_DOMAIN",
        one("FusedMatMul", domain="com.microsoft"))  # fmt: skip
attack(ONNX, "sizes whose product is 0 in 64 bits", "sizes are multiplied without overflow",
       "PLX_ONNX_TENSOR_DATA")(
    lambda: network(lambda p: p.graph.initializer[0].dims.extend([1 << 32, 1 << 32]))
)  # fmt: skip


@attack(
    ONNX, "a table of 2⁴⁰ rows with no data", "data has the stated size", "PLX_ONNX_TENSOR_DATA"
)
def no_data() -> bytes:
    def change(proto: onnx.ModelProto) -> None:
        tensor = proto.graph.initializer.add(name="t", data_type=TensorProto.FLOAT)
        tensor.dims.append(1 << 40)

    return network(change)


refused(ONNX, "rows multiplied with rows: N² elements", WALKED, "PLX_ONNX_SHAPE",
        one("Transpose", "position", "t", perm=[1, 0]), one("MatMul", "position t"))  # fmt: skip
refused(ONNX, "rows made into columns", WALKED, "PLX_ONNX_SHAPE",
        one("Reshape", "position s"), s=np.array([1, -1]))  # fmt: skip
refused(ONNX, "a fixed index beyond its row", WALKED, "PLX_ONNX_SHAPE",
        one("Gather", "position i", axis=1), i=np.array([2**40]))  # fmt: skip
refused(ONNX, "a computed index far below its table", "the validator evaluates; hosts clamp",
        "PLX_GOLDEN_BROKEN", one("Cast", to=TensorProto.INT64, outputs="i"),
        one("Sub", "i far", "j"), one("Gather", "c j"),
        far=np.array([2**40]), c=np.ones(3, np.float32))  # fmt: skip
refused(ONNX, "an integer divided by a computed -1: ONNX Runtime ends with SIGFPE",
        DIVISORS, "PLX_ONNX_SHAPE",
        one("Cast", to=TensorProto.INT64, outputs="i"), one("Div", "least i", "q"),
        least=np.array([-(2**63)]))  # fmt: skip
for _op in ("Div", "Mod"):
    for _number in (0, -1):
        refused(ONNX, f"{_op} of integers by {_number}", DIVISORS, "PLX_ONNX_TYPE",
                one("Cast", to=TensorProto.INT64, outputs="i"),
                one(_op, "i n", "q"), n=np.array([3, _number, 3]))  # fmt: skip
refused(ONNX, "65,000 axes", "lists are short", "PLX_ONNX_SHAPE",
        one("ReduceSum", "position a"), a=np.ones(65_000, np.int64))  # fmt: skip
refused(ONNX, "doubling by Add of broadcast axes: 2¹⁸ elements of 3", WALKED, "PLX_ONNX_COST",
        one("Unsqueeze", "position a", "u"), one("Add", "u c"),
        a=np.array([1]), c=np.ones((1 << 16, 3), np.float32))  # fmt: skip
WEIGHED = "what is read counts, by the slowest evaluator"
WIDE = LIMITS.sample_floats


def heavy(*made: Any, width: int = WIDE, **constants: Any) -> bytes:
    """Nodes behind a wide value `w` of the appearance network."""
    weight = np.ones((3, width), np.float32)
    return nodes(one("MatMul", "position weight", "w"), *made, weight=weight, **constants)


attack(ONNX, "200 sums of 65,536 columns, each one element", WEIGHED, "PLX_ONNX_COST")(
    lambda: heavy(*(one("ReduceSum", "w a", f"s{k}") for k in range(200)), a=np.array([1]))
)
attack(ONNX, "the largest of 256 inputs of 8,192 columns", WEIGHED, "PLX_ONNX_COST")(
    lambda: heavy(one("Max", "w " * 256), width=8192)
)
attack(ONNX, "remainders of large numbers: a division bit by bit", WEIGHED, "PLX_ONNX_COST")(
    lambda: heavy(one("Mod", "w d", fmod=1), d=np.array([0.3], np.float32))
)
attack(ONNX, "100,000 operands of one column", WEIGHED, "PLX_ONNX_COST")(
    lambda: heavy(*(one("Max", "w " * 250, f"m{k}") for k in range(400)), width=1)
)


@attack(ONNX, "1,024 golden vectors of a network at the limit", "their work is added up",
        "PLX_GOLDEN_COST")  # fmt: skip
def costly_vectors() -> bytes:
    made = one("Sin", "w", "a"), one("Cos", "w", "b")
    data = bad.member_of(heavy(*made, width=65_000), APPEARANCE)
    content = lamp.good() | {APPEARANCE: data}
    for name in content:
        if name.startswith("vectors/appearance."):
            dtype = "<f8" if "radiance" in name else "<f4"
            content[name] = npy.dumps(np.ones((LIMITS.vectors, 3), dtype))
    return bad.with_network(data, content)


def filled(field: bytes) -> bytes:
    """A model with a field of its graph that occurs a million times."""
    return bad.with_network(wrapped(b"\x3a", field * 1_000_000))


def wrapped(tag: bytes, content: bytes) -> bytes:
    size, length = len(content), b""
    while size > 127:
        length, size = length + bytes([size & 127 | 128]), size >> 7
    return tag + length + bytes([size]) + content


for _field, _what in (
    (b"\x0a\0", "nodes"),
    (b"\x2a\0", "initializers"),
    (b"\x6a\0", "stated shapes"),
):
    attack(ONNX, f"a million empty {_what}, two bytes each: a gigabyte in memory", STEPPED,
           "PLX_ONNX_TOO_LARGE")(lambda field=_field: filled(field))  # fmt: skip
attack(ONNX, "a node with a million empty inputs and a half", STEPPED, "PLX_ONNX_TOO_LARGE")(
    lambda: bad.with_network(wrapped(b"\x3a", wrapped(b"\x0a", b"\x0a\0" * 1_500_000)))
)
attack(ONNX, "a tensor with three million sizes", STEPPED, "PLX_ONNX_TOO_LARGE")(
    lambda: bad.with_network(
        wrapped(b"\x3a", wrapped(b"\x2a", wrapped(b"\x0a", b"\1" * 3_000_000)))
    )
)
attack(ONNX, "a text of 3 MB", STEPPED, "PLX_ONNX_TOO_LARGE")(
    lambda: network(lambda p: setattr(p, "doc_string", "x" * 3_000_000))
)
attack(ONNX, "groups, which protobuf nests", STEPPED, "PLX_ONNX_PARSE")(
    lambda: bad.with_network(b"\x0b" * 1000 + b"\x0c" * 1000)
)


@attack(ONNX, "graphs nested a thousand deep", "protobuf's own bound", "PLX_ONNX_PARSE")
def nested_graphs() -> bytes:
    content = b""
    for _ in range(1000):  # Graph, node, attribute, graph.
        content = wrapped(b"\x0a", wrapped(b"\x2a", wrapped(b"\x32", content)))
    return bad.with_network(wrapped(b"\x3a", content))


attack(ONNX, "a field longer than the model", STEPPED, "PLX_ONNX_PARSE")(
    lambda: bad.with_network(b"\x3a\xff\xff\xff\xff\x7f")
)
attack(ONNX, "a model in ONNX Runtime's own format, which it detects by itself",
       "the bytes must be a ModelProto", "PLX_ONNX_PARSE")(
    lambda: bad.with_network(b"\x18\0\0\0ORTM" + bytes(200))
)  # fmt: skip
attack(
    ONNX,
    "an initializer in the place of an input",
    "names are given once",
    "PLX_ONNX_DUPLICATE_NAME",
)(lambda: nodes(normal=np.ones(3, np.float32)))
attack(ONNX, "rows in two places, [N, N]", "inputs have the stated sizes", "PLX_ONNX_IO_SIGNATURE")(
    lambda: network(
        lambda p: setattr(p.graph.input[0].type.tensor_type.shape.dim[1], "dim_param", "N")
    )
)
attack(
    ONNX, "a sequence of tensors as input", "inputs have the stated types", "PLX_ONNX_IO_SIGNATURE"
)(lambda: network(lambda p: p.graph.input[0].type.sequence_type.elem_type.tensor_type.Clear()))
attack(ONNX, "infinite weights", "weights are finite", "PLX_ONNX_NON_FINITE_WEIGHT")(
    lambda: bad.set_field("raw_data", np.full((8, 9), np.inf, np.float32).tobytes())
)


# USD: layers that compose

USD = "USD"
WORDS = "a grammar without composition"
GRAMMAR = "a grammar that names all that is allowed"
INSIDE = "paths begin with ./ and name members"
METADATA_END = '    upAxis = "Z"\n'


def in_metadata(text: str) -> bytes:
    return layer(METADATA_END, f"{METADATA_END}    {text}\n")


def with_prims(text: str) -> bytes:
    return layer('    def SphereLight "fallback"', f'{text}\n    def SphereLight "fallback"')


for _text, _what in (
    ("subLayers = [<./more.usda>]", "sublayers"),
    ("relocates = { </a>: </b> }", "relocates"),
    ('expressionVariables = { string X = "/etc" }', "variables of path expressions"),
    ('clips = { dictionary a = { string templateAssetPath = "/etc/x.###.usd" } }',
     "value clips, whose path is a plain string"),
):  # fmt: skip
    attack(USD, _what, WORDS, "PLX_USD_COMPOSITION")(lambda text=_text: in_metadata(text))
for _text, _what in (
    ('    def "a" (references = </octahedron>) {}', "a reference to itself"),
    ('    def "a" (payload = </octahedron>) {}', "a payload"),
    ('    def "a" (inherits = </octahedron>) {}', "inheritance"),
    ('    def "a" (specializes = </octahedron>) {}', "specialization"),
    ('    def "a" (variantSets = "v") { variantSet "v" = { "x" {} } }', "variants"),
):
    attack(USD, _what, WORDS, "PLX_USD_COMPOSITION")(lambda text=_text: with_prims(text))


@attack(
    USD, "thirty prims that reference the one before twice: 2³⁰ prims", WORDS, "PLX_USD_COMPOSITION"
)
def doubling_references() -> bytes:
    return with_prims("\n".join(
        f'    def "x{k + 1}" {{ def "a" (references = </octahedron/x{k}>) {{}}\n'
        f'      def "b" (references = </octahedron/x{k}>) {{}} }}' for k in range(30)
    ))  # fmt: skip


for _path in ("/etc/passwd", "./../../secret.json", "file:///etc/passwd", "http://host/x.json",
              "./a.usdz[b.json]", "./x.json:SDF_FORMAT_ARGS:a=b", '`"${HOME}/x"`', ".\\..\\x.json",
              ""):  # fmt: skip
    attack(USD, f"the asset path `@{_path}@`".replace("``", "`"), INSIDE, "PLX_USD_PATH")(
        lambda path=_path: layer("@./manifest.json@", f"@{path}@")
    )
attack(
    USD,
    "the asset path `@./∕etc∕passwd@` with slashes that are none",
    INSIDE,
    "PLX_USD_PATH_DANGLING",
)(lambda: layer("@./manifest.json@", "@./∕etc∕passwd@"))


def in_prim(text: str) -> bytes:
    return layer("    float purelight:dimmer", f"    {text}\n    float purelight:dimmer")


for _text, _what in (
    ('asset x = "/etc/passwd"', "an asset path in quotation marks, as OpenUSD takes it too"),
    ('asset[] x = ["/etc/passwd"]', "one in a list"),
    ('asset # a comment\n x = # another\n "/etc/passwd"', "one behind comments"),
    ("asset asset:asset =" + " " * 5000 + '"/etc/passwd"', "one behind much space"),
    ('asset [ ] x = [ "/etc/passwd" ]', "one in a list with spaces"),
    ('int x = 1 (customData = { asset "x" = "/outside" })', "one behind a quoted key"),
    ('int x (customData = { dictionary a = { asset[] b = ["/outside"] } })', "one two deep"),
    ("string x = @/etc/passwd@", "an asset path as a string"),
):
    attack(USD, _what, "an asset's value must be an asset path", "PLX_USD_PATH")(
        lambda text=_text: in_prim(text)
    )
for _text, _what in (
    ('asset x.timeSamples = { 0: None, 1e3: "/etc/passwd" }', "an asset path in samples"),
    ('asset inputs:file . timeSamples = { 0: "/outside" }', "samples behind a space"),
    ("float x.spline = { bezier, 1: 5 }", "a spline"),
    ('pathExpression x = "//a//b + /c"', "a path expression"),
    ("opaque x", "an opaque attribute"),
    ("reorder properties = []", "another order of properties"),
    ("delete rel x = </a>", "a relationship that is taken away"),
):
    attack(USD, _what, GRAMMAR, "PLX_USD_NOT_ALLOWED")(lambda text=_text: in_prim(text))
for _text, _what, _code in (
    ("double x = " + "(" * 200_000, "200,000 brackets", "PLX_USD_SYNTAX"),
    ("double[] x = [" + "(" * 5 + "1" + ")" * 5 + "]", "six brackets deep", "PLX_USD_SYNTAX"),
    ("int x (customData = " + "{ dictionary a = " * 5000 + "{}" + "}" * 5001 + ")",
     "5,000 dictionaries in one another, on which OpenUSD dies", "PLX_USD_TOO_DEEP"),
    ('def "a" {' * 5000 + "}" * 5000, "5,000 prims in one another", "PLX_USD_TOO_DEEP"),
    ("string x = '/etc/passwd'", "single quotation marks", "PLX_USD_SYNTAX"),
    ('string x = """a"""" + @/etc/passwd@', "four quotation marks", "PLX_USD_SYNTAX"),
    ("asset x = @@@./a.json@@@", "threefold path marks", "PLX_USD_SYNTAX"),
    ("float x" + "x" * 300 + " = 1", "a name of 300 letters", "PLX_USD_SYNTAX"),
    ("double x = 1" + "0" * 5000, "a number of 5,000 digits", "PLX_USD_SYNTAX"),
):  # fmt: skip
    attack(USD, _what, GRAMMAR, _code)(lambda text=_text: in_prim(text))
attack(USD, "a path in the layer's colorConfiguration, quoted", WORDS, "PLX_USD_COMPOSITION")(
    lambda: in_metadata('colorConfiguration = "/etc/passwd"')
)
attack(USD, "an outer layer between comments `/* \" */ ... /* \" */`", "comments begin with #",
       "PLX_USD_SYNTAX")(
    lambda: in_metadata('/* " */ subLayers = [@/etc/x.usda@] /* " */')
)  # fmt: skip
attack(USD, "a quotation behind `//`", "comments begin with #", "PLX_USD_SYNTAX")(
    lambda: in_metadata('// "')
)
attack(USD, "half-open asset paths, quadratic in a backtracking search", GRAMMAR,
       "PLX_USD_SYNTAX")(lambda: in_metadata("@@@x@ \\" * 200_000))  # fmt: skip
attack(USD, "half-open quotations", GRAMMAR, "PLX_USD_SYNTAX")(
    lambda: in_metadata('"""x" \\ ' * 200_000)
)
attack(USD, "a million quotations", "tokens are counted", "PLX_USD_TOO_COMPLEX")(
    lambda: in_metadata('"a" ' * 1_000_000)
)
attack(USD, "a quotation of a million escapes", "tokens have limits", "PLX_USD_SYNTAX")(
    lambda: in_metadata('doc = "' + "\\n" * 1_000_000 + '"')
)
attack(USD, "a million spaces before a word, for `^\\s*defaultPrim`", "one pass over the text",
       "PLX_USD_NO_DEFAULT_PRIM")(
    lambda: layer('    defaultPrim = "octahedron"\n', "\n" * 1_000_000)
)  # fmt: skip
attack(USD, "a binary layer named .usda", "the text must begin with its header", "PLX_USD_SYNTAX")(
    lambda: layer("#usda 1.0\n", "PXR-USDC\0\0")
)
attack(USD, "a layer of 128 MiB and more", "members have limits", "PLX_MEMBER_TOO_LARGE")(
    lambda: layer("#usda 1.0\n", "#usda 1.0\n#" + "x" * LIMITS.layer_bytes + "\n")
)
attack(USD, "metres that only a dictionary states", "the layer's own metadata",
       "PLX_USD_METERS_PER_UNIT")(
    lambda: layer("    metersPerUnit = 1\n",
                  "    customLayerData = {\n        double metersPerUnit = 1\n    }\n")
)  # fmt: skip
attack(USD, "metres stated twice, of which USD takes the second", "stated once",
       "PLX_USD_METERS_PER_UNIT")(
    lambda: layer("metersPerUnit = 1\n", "metersPerUnit = 1\n    metersPerUnit = 0.01\n")
)  # fmt: skip
attack(USD, "an API that only a text names", "a list of applied schemas", "PLX_USD_SCHEMA_MISSING")(
    lambda: layer('prepend apiSchemas = ["PureLightLuminaireAPI", "GeomModelAPI"]',
                  'doc = "PureLightLuminaireAPI"\n    prepend apiSchemas = ["GeomModelAPI"]')
)  # fmt: skip


# Arrays: code in a header, sizes that overflow

NPY = "Arrays"
HEADER = "one canonical header, matched as text; nothing is evaluated"


class _Payload:
    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return eval, ("1/0",)


attack(NPY, "a pickle as object array", HEADER, "PLX_NPY_HEADER")(
    lambda: bad.member(bad.POSITIONS, npy.MAGIC + b"\x76\0"
        + b"{'descr': '|O', 'fortran_order': False, 'shape': (1,), }".ljust(117) + b"\n"
        + pickle.dumps(_Payload()))
)  # fmt: skip
attack(NPY, "a bare pickle", HEADER, "PLX_NPY_HEADER")(
    lambda: bad.member(bad.POSITIONS, pickle.dumps(_Payload()))
)
for _head in (
    b"{'descr': __import__('os').system('id'), 'fortran_order': False, 'shape': (6, 3), }",
    b"{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (6, 3), }",
    b"{'descr': '<f4', 'fortran_order': False, 'shape': (-6, 3), }",
    b"{'descr': '<f4', 'fortran_order': False, 'shape': (6, 3), 'shape': (1, 3), }",
    b"{'descr': '>f4', 'fortran_order': False, 'shape': (6, 3), }",
):
    attack(NPY, f"the header `{_head.decode()}`", HEADER, "PLX_NPY_HEADER")(
        lambda head=_head: bad.header(head)
    )
for _shape in ("4294967296, 4294967296", "0, 99999999999999999999"):
    attack(NPY, f"the shape ({_shape})", "sizes are multiplied without overflow", "PLX_NPY_SIZE")(
        lambda shape=_shape: bad.header(
            f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}".encode(),
            b"" if shape.startswith("0") else bytes(72),
        )
    )
attack(NPY, "version 2 of the format, with a header of 4 GB", HEADER, "PLX_NPY_HEADER")(
    lambda: bad.member(bad.POSITIONS, b"\x93NUMPY\2\0\xff\xff\xff\xff" + bytes(100))
)


# Lies

LIES = "Lies"
attack(LIES, "a digest of other bytes", "every member is hashed", "PLX_MANIFEST_DIGEST_MISMATCH")(
    lambda: bad.listed(APPEARANCE, {"size": len(lamp.good()[APPEARANCE]), "sha256": "0" * 64})
)
attack(
    LIES,
    "a member that no manifest lists",
    "all members are listed",
    "PLX_MANIFEST_MEMBER_UNLISTED",
)(lambda: bad.listed("extensions/hidden", None, {"extensions/hidden": b"#!/bin/sh"}))
attack(LIES, "a manifest that lists itself", "its digest cannot be its own", "PLX_MANIFEST_SCHEMA")(
    lambda: bad.listed("manifest.json", {"size": 1, "sha256": "0" * 64})
)
attack(
    LIES,
    "a network that costs more than it says",
    "the cost is counted",
    "PLX_MANIFEST_COST_MISMATCH",
)(lambda: edited("networks/appearance/floats_per_sample", 1))
attack(
    LIES,
    "another network's values as golden vectors",
    "the validator evaluates",
    "PLX_GOLDEN_MISMATCH",
)(lambda: bad.golden("vectors/transparency.transmittance.npy", lambda y: y[::-1]))
attack(
    LIES,
    "tolerances that let any host pass",
    "a warning above a fifth",
    "PLX_GOLDEN_TOLERANCE_LOOSE",
)(lambda: bad.golden("vectors/sampler.pdf_solid_angle.tolerance.npy", lambda t: t + 1e6))
attack(
    LIES,
    "flux in a channel that is absent",
    "flux and channels are compared",
    "PLX_MANIFEST_FLUX_INVALID",
)(lambda: edited("channels", [False, True, True]))
attack(
    LIES,
    "a surface that emits more than the lamp",
    "a warning above 1 %",
    "PLX_SURFACE_FLUX_CLOSURE",
)(lambda: bad.array(bad.FLUX, np.full((8, 3), 5)))
attack(LIES, "a preview of 65,536 x 65,536 pixels in 100 bytes", "sizes are read from its head",
       "PLX_PREVIEW_TOO_LARGE")(
    lambda: bad.member(
        "preview.png", lamp.PNG[:16] + struct.pack(">2I", 65536, 65536) + lamp.PNG[24:]
    )
)  # fmt: skip
attack(LIES, "a page of HTML as photometry", "it must begin as IES does", "PLX_PHOTOMETRY_INVALID")(
    lambda: bad.member("photometry.ies", b"<script>")
)


# Beside the bundle

SIDE = "Side files"


def beside(abuse: str, code: str, change: Callable[[str], str]) -> None:
    """Registers a layer beside the good lamp: a fault that warns, as the bundle stays valid."""
    ATTACKS.append(Attack(SIDE, abuse, "the layer beside a bundle is vetted and compared", code))
    bad.BESIDE.setdefault(code, []).append(lambda: change(bad.side_text()).encode())


beside("a layer made for another bundle", "PLX_SIDE_DIGEST_MISMATCH",
       lambda text: text.replace(bad.side_digest(), "0" * 64))  # fmt: skip
beside("a layer without a digest", "PLX_SIDE_DIGEST_MISMATCH",
       lambda text: text.replace("purelight:bundleDigest", "purelight:digest"))  # fmt: skip
beside("a layer that references `/etc/x.usda`", "PLX_SIDE_LAYER_INVALID",
       lambda text: text.replace("kind =", "references = @/etc/x.usda@\n    kind ="))  # fmt: skip
beside(
    "a layer of half-open asset paths",
    "PLX_SIDE_LAYER_INVALID",
    lambda text: text + "@@@x@ \\" * 200_000,
)
beside("a layer that names a picture that is not there", "PLX_SIDE_LAYER_INVALID",
       lambda text: text.replace("    rel", "    asset x = @./no.png@\n    rel", 1))  # fmt: skip
