"""Files for the class Reader: each breaks one rule of the format, or breaks none and warns."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from purelight_conformance.protocol import READER
from purelight_conformance.suite import NEVER, REQUIRED, Suite, VectorSet
from purelight_format import atomic, members
from purelight_format.bundle import Bundle
from purelight_format.issues import CODES, Severity
from purelight_format.members import MANIFEST, PHOTOMETRY, PREVIEW, container, npy

Members = dict[str, bytes]
Make = Callable[[Members], bytes]  # The members of a valid lamp in their order -> a file.
Change = Callable[[Any], object]  # Of the manifest's JSON, or of a network's protobuf, in place.

LOCAL, CENTRAL = b"PK\3\4", b"PK\1\2"
APPEARANCE, EXTRA = members.network("appearance"), "extensions/note"
POSITIONS, TRIANGLES, FLUX = (
    f"surface/{k}.npy" for k in ("positions", "triangles", "triangle_flux")
)
RADIANCE, TOLERANCE = (f"vectors/appearance.radiance{k}.npy" for k in ("", ".tolerance"))


def seal(content: Members, edit: Change = lambda root: None) -> bytes:
    """Packs members with a manifest that lists them as they are, after an edit of its JSON."""
    root = json.loads(content[MANIFEST])
    root["members"] = {
        name: {"size": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        for name, data in content.items()
        if name != MANIFEST
    }
    edit(root)
    return container.pack({**content, MANIFEST: json.dumps(root).encode()})


# Container


def patched(signature: bytes, offset: int, value: bytes) -> Make:
    """Overwrites bytes of the file's last record of a kind."""

    def make(content: Members) -> bytes:
        data = container.pack(content)
        start = data.rindex(signature) + offset
        return data[:start] + value + data[start + len(value) :]

    return make


def resized(content: Members, start: int, removed: int, put: bytes) -> bytes:
    """Replaces bytes between the headers, and moves the directory accordingly."""
    data = container.pack(content)
    directory = int.from_bytes(data[-6:-2], "little") + len(put) - removed
    moved = data[:start] + put + data[start + removed :]
    return moved[:-6] + struct.pack("<I", directory) + moved[-2:]


def gap(content: Members) -> bytes:
    """64 bytes between the last member and the directory."""
    last = list(container.scan(container.pack(content)).values())[-1]
    return resized(content, last.start + last.size, 0, bytes(64))


def unpadded(content: Members) -> bytes:
    """The last member follows its header at once."""
    last = list(container.scan(container.pack(content)).values())[-1]
    start = last.header + container.LOCAL.size
    name, padding = last.name.encode(), last.start - start - len(last.name)
    return resized(content, start - 2, 2 + len(name) + padding, b"\0\0" + name)


def damaged(content: Members) -> bytes:
    """The last byte of the last member is another."""
    data = bytearray(container.pack(content))
    data[data.index(CENTRAL) - 1] ^= 1
    return bytes(data)


def renamed(name: str) -> Make:
    """One more member, with a name that the writer would not take."""
    stand_in = "x" * len(name)

    def make(content: Members) -> bytes:
        def edit(root: dict[str, Any]) -> None:
            root["members"][name] = root["members"].pop(stand_in)

        return seal({**content, stand_in: b""}, edit).replace(stand_in.encode(), name.encode())

    return make


# Manifest


def text(change: Callable[[bytes], bytes]) -> Make:
    """Another text for the manifest."""
    return lambda content: container.pack({**content, MANIFEST: change(content[MANIFEST])})


def edited(path: str, value: Any) -> Make:
    """One field of the manifest changed."""

    def edit(root: dict[str, Any]) -> None:
        *parents, last = path.split("/")
        for key in parents:
            root = root[key]
        root[last] = value

    return lambda content: seal(content, edit)


def nested(depth: int) -> dict[str, Any]:
    return {"a": nested(depth - 1)} if depth else {}


def unlisted(content: Members) -> bytes:
    return seal({**content, EXTRA: b""}, lambda root: root["members"].pop(EXTRA))


# Networks


def model(change: Callable[[bytes], bytes]) -> Make:
    """Other bytes for the appearance network, of which the manifest knows the size."""

    def make(content: Members) -> bytes:
        data = change(content[APPEARANCE])

        def edit(root: dict[str, Any]) -> None:
            root["networks"]["appearance"]["bytes"] = len(data)

        return seal({**content, APPEARANCE: data}, edit)

    return make


def network(change: Change) -> Make:
    """A changed appearance network."""

    def changed(data: bytes) -> bytes:
        import onnx

        proto = onnx.load_from_string(data)
        change(proto)
        return proto.SerializeToString(deterministic=True)

    return model(changed)


def node(op: str, inputs: str = "position", domain: str = "", **attributes: Any) -> Make:
    """One more node, in front of the others."""

    def change(proto: Any) -> None:
        from onnx import helper

        made = helper.make_node(op, inputs.split(), ["more"], domain=domain, **attributes)
        proto.graph.node.insert(0, made)

    return network(change)


def subgraph(proto: Any) -> None:
    proto.graph.node[0].attribute.add(name="body", type=5).g.name = "inner"


def constant(data_type: int, value: bytes) -> Make:
    """One more initializer, which no node reads."""
    return network(
        lambda proto: proto.graph.initializer.add(
            name="more", data_type=data_type, dims=[1], raw_data=value
        )
    )


def doubling(proto: Any) -> None:
    """3 · 2²⁴ elements."""
    from onnx import helper

    names = ["position", *(f"more{k}" for k in range(24))]
    made = [helper.make_node("Concat", [a, a], [b], axis=1) for a, b in pairwise(names)]
    proto.graph.node.extend(made)


# Other members


def member(name: str, data: bytes) -> Make:
    return lambda content: seal({**content, name: data})


def array(name: str, value: Any, dtype: str = "<f4") -> Make:
    return member(name, npy.dumps(np.asarray(value, dtype)))


def scaled(name: str, factor: float) -> Make:
    """Values of the golden vectors times a factor."""

    def make(content: Members) -> bytes:
        value = npy.loads(content[name], name, "<f8") * factor
        return seal({**content, name: npy.dumps(value)})

    return make


def unproven(content: Members) -> bytes:
    return seal({k: v for k, v in content.items() if not k.startswith("vectors/")})


def no_vector(content: Members) -> bytes:
    """Golden vectors that are none."""
    none = {
        name: npy.dumps(np.zeros((0, 3), "<f8" if "radiance" in name else "<f4"))
        for name in content
        if name.startswith("vectors/")
    }
    return seal({**content, **none})


def layer(old: str, new: str) -> Make:
    """A text of the USD layer replaced."""

    def make(content: Members) -> bytes:
        name = next(iter(content))
        return seal({**content, name: content[name].replace(old.encode(), new.encode(), 1)})

    return make


FAULTS: dict[str, Make] = {
    "PLX_ZIP_TRUNCATED": lambda content: container.pack(content)[:-1],
    "PLX_ZIP_TRAILING_DATA": lambda content: container.pack(content) + b"more",
    "PLX_ZIP_COMPRESSED": patched(LOCAL, 8, b"\x08"),
    "PLX_ZIP_NOT_CANONICAL": patched(LOCAL, 10, b"\1"),
    "PLX_ZIP_HEADER_MISMATCH": patched(CENTRAL, 24, b"\1\0\0\0"),
    "PLX_ZIP_GAP": gap,
    "PLX_ZIP_OVERLAP": patched(LOCAL, 18, b"\xff\xff\xff\0" * 2),
    "PLX_ZIP_MISALIGNED": unpadded,
    "PLX_ZIP_CRC": damaged,
    "PLX_ZIP_NAME_INVALID": renamed("../../passwd"),
    "PLX_ZIP_NAME_DUPLICATE": renamed(POSITIONS),
    "PLX_JSON_ENCODING": text(lambda data: b"\xef\xbb\xbf" + data),
    "PLX_JSON_TOO_DEEP": edited("extensions", nested(20)),
    "PLX_JSON_DUPLICATE_KEY": text(lambda data: data.replace(b"{", b'{"r_max": 2,', 1)),
    "PLX_JSON_NON_FINITE": edited("r_max", float("inf")),
    "PLX_MANIFEST_MISSING": lambda content: container.pack(
        {name: data for name, data in content.items() if name != MANIFEST}
    ),
    "PLX_MANIFEST_VERSION_UNSUPPORTED": edited("format_version", "2.0"),
    "PLX_MANIFEST_VERSION_NEWER": edited("format_version", "1.1"),
    "PLX_MANIFEST_SCHEMA": edited("name", "two\nlines"),
    "PLX_MANIFEST_UNKNOWN_FIELD": edited("mood", "cosy"),
    "PLX_MANIFEST_UNITS": edited("units/length", "cm"),
    "PLX_MANIFEST_SPHERE_INVALID": edited("bounding_sphere/radius", 0),
    "PLX_MANIFEST_FLUX_INVALID": edited("channels", [True, True, False]),
    "PLX_MANIFEST_SCALE_INVALID": edited("radiance_scale", 0),
    "PLX_MANIFEST_RMAX_INVALID": edited("r_max", 1),
    "PLX_MANIFEST_FINISH_ENERGY": edited(
        "finishes",
        [{"name": "chalk", "base_color": [1, 1, 1], "scattered_ahead": [0.5, 0.5, 0.5]}],
    ),
    "PLX_MANIFEST_NETWORK_MISSING": edited("networks", {}),
    "PLX_MANIFEST_NETWORK_UNKNOWN": edited(
        "networks/polarisation",
        {"member": members.network("polarisation"), "macs_per_sample": 1,
         "floats_per_sample": 1, "bytes": 1},
    ),
    "PLX_MANIFEST_VERDICT": edited("fidelity/verdict", {"photons": "many"}),
    "PLX_MANIFEST_MEMBER_MISSING": edited("members/lost", {"size": 0, "sha256": "0" * 64}),
    "PLX_MANIFEST_MEMBER_UNLISTED": unlisted,
    "PLX_MANIFEST_DIGEST_MISMATCH": edited("members/plain.usda/sha256", "0" * 64),
    "PLX_MANIFEST_COST_MISMATCH": edited("networks/appearance/macs_per_sample", 1),
    "PLX_MEMBER_UNKNOWN": member("networks/more.onnx", b""),
    "PLX_ONNX_PARSE": model(lambda data: b"\xff" * 100),
    "PLX_ONNX_OPSET": network(lambda proto: setattr(proto.opset_import[0], "version", 17)),
    "PLX_ONNX_FOREIGN_DOMAIN": node("Relu", domain="com.microsoft"),
    "PLX_ONNX_FEATURE": network(lambda proto: proto.functions.add(name="f")),
    "PLX_ONNX_EXTERNAL_DATA": network(
        lambda proto: proto.graph.initializer[0].external_data.add(
            key="location", value="../../passwd"
        )
    ),
    "PLX_ONNX_TENSOR_TYPE": constant(11, bytes(8)),
    "PLX_ONNX_NON_FINITE_WEIGHT": constant(1, struct.pack("<f", np.nan)),
    "PLX_ONNX_UNUSED_INITIALIZER": constant(1, bytes(4)),
    "PLX_ONNX_UNDEFINED_NAME": node("Relu", "nowhere"),
    "PLX_ONNX_IO_SIGNATURE": network(
        lambda proto: setattr(proto.graph.input[0], "name", "location")
    ),
    "PLX_ONNX_OP_NOT_ALLOWED": node("Loop"),
    "PLX_ONNX_SUBGRAPH": network(subgraph),
    "PLX_ONNX_SHAPE": node("MatMul", "position normal"),
    "PLX_ONNX_TYPE": node("And", "position position"),
    "PLX_ONNX_COST": network(doubling),
    "PLX_ONNX_METADATA": network(lambda proto: setattr(proto, "doc_string", "/home/me/net.py")),
    "PLX_NPY_HEADER": member(POSITIONS, b"no array"),
    "PLX_NPY_SHAPE": array(POSITIONS, np.zeros((6, 2))),
    "PLX_NPY_NON_FINITE": array(POSITIONS, np.full((6, 3), np.nan)),
    "PLX_SURFACE_INDEX": array(TRIANGLES, np.full((10, 3), 6), "<u4"),
    "PLX_SURFACE_FLUX": array(FLUX, np.full((10, 3), -1)),
    "PLX_SURFACE_OUTSIDE_SPHERE": array(POSITIONS, np.full((6, 3), 7)),
    "PLX_SURFACE_FLUX_CLOSURE": array(FLUX, np.full((10, 3), 0.01)),
    "PLX_USD_NOT_FIRST": lambda content: seal(dict(reversed(content.items()))),
    "PLX_USD_SYNTAX": layer("#usda 1.0", "#usda 2.0"),
    "PLX_USD_NOT_ALLOWED": layer('upAxis = "Z"', 'upAxis = "Z"\n    permission = "public"'),
    "PLX_USD_TOO_DEEP": layer(
        'upAxis = "Z"',
        'upAxis = "Z"\n    customLayerData = ' + "{ dictionary a = " * 16 + "{}" + "}" * 16,
    ),
    "PLX_USD_NO_DEFAULT_PRIM": layer("defaultPrim = ", "doc = "),
    "PLX_USD_SCHEMA_MISSING": layer('"PureLightLuminaireAPI", ', ""),
    "PLX_USD_PATH": layer("@./manifest.json@", "@./../../passwd@"),
    "PLX_USD_COMPOSITION": layer('upAxis = "Z"', 'upAxis = "Z"\n    relocates = { </a>: </b> }'),
    "PLX_USD_METERS_PER_UNIT": layer("metersPerUnit = 1", "metersPerUnit = 0.01"),
    "PLX_GOLDEN_MISSING": unproven,
    "PLX_GOLDEN_SHAPE": no_vector,
    "PLX_GOLDEN_TOLERANCE_INVALID": scaled(TOLERANCE, -1),
    "PLX_GOLDEN_TOLERANCE_LOOSE": scaled(TOLERANCE, 1e6),
    "PLX_GOLDEN_MISMATCH": scaled(RADIANCE, 2),
    "PLX_GOLDEN_RANGE": scaled(RADIANCE, -1),
    "PLX_PREVIEW_INVALID": member(PREVIEW, b"GIF89a"),
    "PLX_PHOTOMETRY_INVALID": member(PHOTOMETRY, b"<html>"),
}  # fmt: skip


def write(lamp: Bundle, folder: Path) -> Suite:
    """Writes a file for each fault, named after its issue; those that only warn are valid.

    Raises:
        PureLightError: If a file cannot be written, or the onnx package is not installed.
    """
    content = {name: lamp.read(name) for name in lamp.entries}
    sets, paths = [], {}
    for code, make in FAULTS.items():
        name = code.removeprefix("PLX_").lower()
        paths[name] = folder / f"{name}.plux"
        atomic.write_bytes(paths[name], make(content))
        valid = CODES[code].severity is Severity.WARNING
        sets.append(put(name, {"issue": code, "rule": CODES[code].anchor}, valid=valid))
    return Suite(tuple(sets), paths)


def put(bundle: str, parameters: dict[str, str], *, valid: bool) -> VectorSet:
    """One file as a set of one vector: there is nothing to evaluate, the host opens it."""
    return VectorSet(
        f"{READER}/{bundle}", READER, READER, bundle, {}, {}, {},
        {"OVERSTRICT" if valid else "UNVETTED": [0]}, parameters, NEVER if valid else REQUIRED,
    )  # fmt: skip
