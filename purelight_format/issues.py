"""Every issue a validator can report: its code, severity, message and the rule it enforces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any, NoReturn

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.limits import LIMITS

LONGEST = 300  # Characters of a file's own words in a report.


class Severity(str, Enum):
    """How bad an issue is; only an error makes a bundle invalid."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class Code:
    """A kind of issue.

    Arguments:
        name: `PLX_<STAGE>_<WHAT>`; never reused for another meaning.
        message: template of one line.
        anchor: the rule in spec/, as file#anchor.
        severity: error or warning.
    """

    name: str
    message: str
    anchor: str
    severity: Severity = Severity.ERROR


@dataclass(frozen=True)
class Issue:
    """One finding.

    Arguments:
        code: the kind.
        location: byte offset, member, JSON pointer or node.
        message: what is wrong, in one line.
    """

    code: Code
    location: str
    message: str

    @property
    def is_error(self) -> bool:
        return self.code.severity is Severity.ERROR


class FormatError(PureLightError):
    """A fault in a file, with its issue."""

    def __init__(self, issue: Issue) -> None:
        super().__init__(f"{issue.code.name} at {issue.location}: {issue.message}")
        self.issue = issue


class Findings:
    """Issues in the order found, no more of each severity than a report holds and one.

    Arguments:
        most: how many errors, and how many warnings, a report holds.
    """

    def __init__(self, most: int = LIMITS.issues) -> None:
        self.errors: list[Issue] = []
        self.warnings: list[Issue] = []
        self._most = most

    def add(self, found: Issue) -> None:
        """Notes an issue, unless there are enough of its severity."""
        kind = self.errors if found.is_error else self.warnings
        if len(kind) <= self._most:
            kind.append(found)

    def __iter__(self) -> Iterator[Issue]:
        return iter((*self.errors, *self.warnings))


def issue(code_name: str, location: str, /, **values: Any) -> Issue:
    """Makes an issue; control characters in the file's own words are escaped, long ones cut."""
    code = CODES[code_name]
    message = code.message.format(**{key: _value(value) for key, value in values.items()})
    return Issue(code, plain(location), message)


def fail(code_name: str, location: str, /, **values: Any) -> NoReturn:
    """Raises the `FormatError` of an issue."""
    raise FormatError(issue(code_name, location, **values))


def plain(value: Any, longest: int = LONGEST) -> str:
    """A text that is fit to be shown in one line: nothing of it can steer a terminal."""
    text = str(value)
    text = text if len(text) <= longest else f"{text[: longest - 1]}…"
    return text if text.isprintable() else text.encode("unicode_escape").decode()


def _value(value: Any) -> Any:
    return float(value) if isinstance(value, (float, np.floating)) else plain(value)


W = Severity.WARNING

_TABLE = (
    # The file as a container
    Code("PLX_FILE_TOO_LARGE", "{size} bytes, at most {limit} are allowed", "plux.md#c1"),
    Code("PLX_ZIP_BAD_SIGNATURE", "this is no zip file", "plux.md#c2"),
    Code("PLX_ZIP_TRUNCATED", "the file ends before its directory does", "plux.md#c2"),
    Code("PLX_ZIP_TRAILING_DATA", "{size} bytes follow the end of the zip file", "plux.md#c2"),
    Code("PLX_ZIP_COMMENT", "the zip file carries a comment", "plux.md#c2"),
    Code("PLX_ZIP_ZIP64", "zip64 structures are not allowed", "plux.md#c3"),
    Code("PLX_ZIP_ENCRYPTED", "the member is encrypted", "plux.md#c3"),
    Code("PLX_ZIP_DATA_DESCRIPTOR", "the member's size follows its data", "plux.md#c3"),
    Code("PLX_ZIP_COMPRESSED", "compression method {method}; members must be stored", "plux.md#c3"),
    Code("PLX_ZIP_NOT_REGULAR", "the member is not a regular file", "plux.md#c3"),
    Code("PLX_ZIP_NOT_CANONICAL", "{field} is {value}, must be {expected}", "plux.md#c4"),
    Code("PLX_ZIP_HEADER_MISMATCH", "the directory contradicts the member: {field}", "plux.md#c5"),
    Code("PLX_ZIP_GAP", "bytes that belong to no member", "plux.md#c6"),
    Code("PLX_ZIP_OVERLAP", "the member reaches into what follows it", "plux.md#c6"),
    Code("PLX_ZIP_MISALIGNED", "the data starts at {offset}, no multiple of 64", "plux.md#c7"),
    Code("PLX_ZIP_CRC", "the data does not match its CRC-32", "plux.md#c8"),
    Code("PLX_ZIP_NAME_INVALID", "{name!r} is not an allowed member name", "plux.md#c9"),
    Code("PLX_ZIP_NAME_DUPLICATE", "{name!r} stands for two things", "plux.md#c9"),
    Code("PLX_ZIP_TOO_MANY_MEMBERS", "{count} members, at most {limit}", "plux.md#c10"),
    # JSON
    Code("PLX_JSON_TOO_LARGE", "{size} bytes, at most {limit} are allowed", "plux.md#j1"),
    Code("PLX_JSON_ENCODING", "the text is not plain UTF-8 (byte {offset})", "plux.md#j1"),
    Code("PLX_JSON_SYNTAX", "no valid JSON: {error}", "plux.md#j2"),
    Code("PLX_JSON_DUPLICATE_KEY", "the key {key!r} occurs twice", "plux.md#j2"),
    Code("PLX_JSON_NON_FINITE", "{number} is no finite number", "plux.md#j3"),
    Code("PLX_JSON_TOO_DEEP", "nested deeper than {limit} levels", "plux.md#j1"),
    # The manifest
    Code("PLX_MANIFEST_MISSING", "the bundle has no manifest.json", "plux.md#m1"),
    Code("PLX_MANIFEST_VERSION_UNSUPPORTED",
         "the format version is {version}, this reads {known}; update purelight", "plux.md#m2"),
    Code("PLX_MANIFEST_VERSION_NEWER",
         "format version {version}, read as {known}: newer fields are ignored", "plux.md#m2", W),
    Code("PLX_MANIFEST_SCHEMA", "the field {expected}", "plux.md#m3"),
    Code("PLX_MANIFEST_UNKNOWN_FIELD", "unknown field, kept but ignored", "plux.md#m4", W),
    Code("PLX_MANIFEST_UNITS", "units must be {expected}", "plux.md#m5"),
    Code("PLX_MANIFEST_SPHERE_INVALID",
         "the radius must be in [1e-6, 1e6] m, the centre within 1e6 m of the origin",
         "plux.md#m6"),
    Code("PLX_MANIFEST_FLUX_INVALID",
         "flux must be in [1e-30, 1e30] W in present channels and 0 in absent ones", "plux.md#m7"),
    Code("PLX_MANIFEST_DARK", "no channel carries flux", "plux.md#m7", W),
    Code("PLX_MANIFEST_SCALE_INVALID", "the radiance scale must be in [1e-30, 1e30]", "plux.md#m8"),
    Code("PLX_MANIFEST_RMAX_INVALID", "r_max must be above 1 radius, at most 1e6", "plux.md#m9"),
    Code("PLX_MANIFEST_NETWORK_UNKNOWN", "no network of this name is defined; it is ignored",
         "plux.md#m10", W),
    Code("PLX_MANIFEST_NETWORK_MISSING", "the bundle needs the network {network}", "plux.md#m10"),
    Code("PLX_MANIFEST_MEMBER_MISSING", "the bundle lacks the member {member}", "plux.md#m11"),
    Code("PLX_MANIFEST_MEMBER_UNLISTED", "the manifest does not list this member", "plux.md#m11"),
    Code("PLX_MANIFEST_DIGEST_MISMATCH", "the {what} differs from the manifest's", "plux.md#m12"),
    Code("PLX_MANIFEST_COST_MISMATCH", "the manifest says {stated}, it is {actual}", "plux.md#m13"),
    Code("PLX_MANIFEST_VERDICT", "fidelity.verdict is not in the form of M15; it is ignored",
         "plux.md#m15", W),
    Code("PLX_MANIFEST_FINISH_COUNT", "{count} finishes, at most {limit}", "plux.md#f1"),
    Code("PLX_MANIFEST_FINISH_ENERGY", "it reflects and lets through {total:.6} of the light",
         "plux.md#f2"),
    # Networks
    Code("PLX_ONNX_TOO_LARGE", "{what}: {size}, at most {limit}", "onnx_profile.md#n1"),
    Code("PLX_ONNX_PARSE", "these bytes are no ONNX model", "onnx_profile.md#n2"),
    Code("PLX_ONNX_IR_VERSION", "IR version {version}, must be {expected}", "onnx_profile.md#n2"),
    Code("PLX_ONNX_OPSET", "opset {version}, must be {expected}", "onnx_profile.md#n2"),
    Code("PLX_ONNX_FOREIGN_DOMAIN", "the domain {domain!r} is not allowed", "onnx_profile.md#n3"),
    Code("PLX_ONNX_FEATURE", "{feature} are not allowed", "onnx_profile.md#n4"),
    Code("PLX_ONNX_EXTERNAL_DATA", "weights lie outside the model", "onnx_profile.md#n5"),
    Code("PLX_ONNX_TENSOR_TYPE", "element type {type} is not allowed", "onnx_profile.md#n6"),
    Code("PLX_ONNX_TENSOR_DATA", "the tensor is not plain: {what}", "onnx_profile.md#n6"),
    Code("PLX_ONNX_NON_FINITE_WEIGHT", "a weight is not finite", "onnx_profile.md#n7"),
    Code("PLX_ONNX_NAME_INVALID", "a name is empty or not printable", "onnx_profile.md#n8"),
    Code("PLX_ONNX_DUPLICATE_NAME", "the name {name!r} is given twice", "onnx_profile.md#n8"),
    Code("PLX_ONNX_UNDEFINED_NAME", "{name!r} is used before it is computed", "onnx_profile.md#n8"),
    Code("PLX_ONNX_IO_SIGNATURE", "{what} must be {expected}", "onnx_profile.md#n9"),
    Code("PLX_ONNX_OP_NOT_ALLOWED", "the profile has no operator {op}", "onnx_profile.md#n10"),
    Code("PLX_ONNX_ATTRIBUTE", "not allowed: {what}", "onnx_profile.md#n11"),
    Code("PLX_ONNX_SUBGRAPH", "the attribute {name!r} holds a graph", "onnx_profile.md#n11"),
    Code("PLX_ONNX_SHAPE", "{op}: {what}", "onnx_profile.md#n12"),
    Code("PLX_ONNX_TYPE", "{op}: {what}", "onnx_profile.md#n13"),
    Code("PLX_ONNX_COST", "{size} {what} per sample, at most {limit}", "onnx_profile.md#n14"),
    Code("PLX_ONNX_UNUSED_INITIALIZER", "no node reads it", "onnx_profile.md#n15", W),
    Code("PLX_ONNX_METADATA", "the model carries texts about its making", "onnx_profile.md#n15",
         W),
    # Arrays
    Code("PLX_NPY_HEADER", "no plain .npy array: {what}", "plux.md#a1"),
    Code("PLX_NPY_TYPE", "elements are {dtype}, must be {expected}", "plux.md#a2"),
    Code("PLX_NPY_SHAPE", "the shape is {shape}, must be {expected}", "plux.md#a2"),
    Code("PLX_NPY_SIZE", "the data has {size} bytes, the header says {expected}", "plux.md#a1"),
    Code("PLX_NPY_TOO_LARGE", "{size} bytes, at most {limit}", "plux.md#a3"),
    Code("PLX_NPY_NON_FINITE", "a value is not finite", "plux.md#a4"),
    Code("PLX_SURFACE_EMPTY", "there are no triangles", "plux.md#s1"),
    Code("PLX_SURFACE_INDEX", "triangle {triangle} names a vertex that does not exist",
         "plux.md#s1"),
    Code("PLX_SURFACE_FLUX", "a triangle's flux is negative", "plux.md#s2"),
    Code("PLX_SURFACE_OUTSIDE_SPHERE", "a vertex is {distance:.6} radii from the centre",
         "plux.md#s3"),
    Code("PLX_SURFACE_CROWDED",
         "a ray meets the boxes of {count} triangles, at most {limit}; "
         "remove copies and divide long ones",
         "plux.md#s5"),
    Code("PLX_SURFACE_FLUX_CLOSURE",
         "the triangles' flux in channel {channel} is {ratio:.4} of the manifest's",
         "plux.md#s4", W),
    Code("PLX_SURFACE_FINISH", "a side of triangle {triangle} has a finish that is none of {count}",
         "plux.md#f3"),
    # The USD layer
    Code("PLX_USD_NOT_FIRST", "the first member must be the only USD layer", "usd.md#u1"),
    Code("PLX_USD_SYNTAX", "no readable layer: {what}", "usd.md#u2"),
    Code("PLX_USD_TOO_COMPLEX", "over {limit} words, quotations, paths and marks", "usd.md#u2"),
    Code("PLX_USD_TOO_DEEP", "prims or dictionaries nested deeper than {limit}", "usd.md#u2"),
    Code("PLX_USD_NOT_ALLOWED", "{word!r} has no place in the layer of a bundle", "usd.md#u2"),
    Code("PLX_USD_NO_DEFAULT_PRIM", "the layer has no default prim", "usd.md#u3"),
    Code("PLX_USD_SCHEMA_MISSING", "no prim applies PureLightLuminaireAPI", "usd.md#u4"),
    Code("PLX_USD_PATH", "{path!r} does not begin with ./ or leaves the folder", "usd.md#u5"),
    Code("PLX_USD_PATH_DANGLING", "{path!r} is not in the bundle", "usd.md#u5"),
    Code("PLX_USD_REFERENCES_LAYER", "{path!r} would compose another layer", "usd.md#u6"),
    Code("PLX_USD_COMPOSITION", "the layer of a bundle may not compose: {word}", "usd.md#u6"),
    Code("PLX_USD_METERS_PER_UNIT", "metersPerUnit is not 1 or upAxis not Z", "usd.md#u7"),
    # The layer beside a bundle
    Code("PLX_SIDE_DIGEST_MISMATCH", "made for another bundle: bundleDigest is {digest!r}",
         "usd.md#u8", W),
    Code("PLX_SIDE_LAYER_INVALID", "{code} at {location}: {message}", "usd.md#u8", W),
    # Golden vectors
    Code("PLX_GOLDEN_MISSING", "the network {network} has no golden vectors", "conformance.md#g1"),
    Code("PLX_GOLDEN_SHAPE", "{count} vectors, must be 1 to {limit}", "conformance.md#g2"),
    Code("PLX_GOLDEN_TOLERANCE_INVALID", "a tolerance is negative", "conformance.md#g3"),
    Code("PLX_GOLDEN_TOLERANCE_LOOSE", "a tolerance is {ratio:.3} of its value",
         "conformance.md#g3", W),
    Code("PLX_GOLDEN_COST",
         "the golden vectors take {size} ms of work, at most {limit}; use fewer of them",
         "conformance.md#g2"),
    Code("PLX_GOLDEN_MISMATCH",
         "{count} of {total} vectors are not met by the reference evaluator (error {error:.3})",
         "conformance.md#g4"),
    Code("PLX_GOLDEN_BROKEN", "the network fails on its golden vectors: {what}",
         "conformance.md#g4"),
    Code("PLX_GOLDEN_RANGE", "{count} values are not {expected}", "conformance.md#g5"),
    Code("PLX_GOLDEN_CHANNEL", "{count} values are not 0 in a channel that carries no flux",
         "conformance.md#g6", W),
    # The validator itself
    Code("PLX_VALIDATOR_FAULT",
         "the validator failed, so the bundle counts as invalid; please report it: {what}",
         "plux.md#v1"),
    # Pictures and photometry
    Code("PLX_PREVIEW_INVALID", "the preview is no PNG picture", "plux.md#p1"),
    Code("PLX_PREVIEW_TOO_LARGE", "the preview has {size} pixels, at most {limit} each way",
         "plux.md#p1"),
    Code("PLX_PHOTOMETRY_INVALID", "the photometry is no IES LM-63 text", "plux.md#p2"),
    Code("PLX_MEMBER_UNKNOWN", "no use of this member is defined; it is ignored", "plux.md#m14", W),
    Code("PLX_MEMBER_TOO_LARGE", "{size} bytes, at most {limit}", "plux.md#m14"),
)  # fmt: skip

CODES = {code.name: code for code in _TABLE}
