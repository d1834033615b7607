"""The suite as data: sets of vectors, and the folder they are kept in."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from purelight_conformance.flags import FLAGS
from purelight_format import atomic
from purelight_format.errors import PureLightError
from purelight_format.files import is_file, read_file
from purelight_format.issues import FormatError

VERSION = "1.0"
INDEX_BYTES, SET_BYTES, ROWS = 4 << 20, 64 << 20, 1 << 20  # Ours has less than a tenth.
INDEX = "suite.json"
DAMAGE = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError)
NEVER, ALLOWED, REQUIRED = "never", "allowed", "required"  # Whether a host may refuse a set.

Arrays = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class VectorSet:
    """Vectors that a host evaluates in one call; row k is the vector `id/k`.

    Arguments:
        id: unique.
        group: what they test, for the summary.
        operation: a key of `operations.OPERATIONS`, or READER, which is one vector without arrays.
        bundle: name of the lamp, empty for pure geometry.
        inputs: float32 [K, ...].
        outputs: float64 [K, ...]; empty where a refusal is required.
        tolerances: float64, shaped as the outputs.
        flags: the rows that hunt each bug.
        parameters: of the whole call.
        refusal: whether the host may refuse, one of NEVER, ALLOWED, REQUIRED.
        rows: how many rows to send, the K vectors over and over.
        average: how many rows of the inputs make one vector: the mean of their results is compared.
    """

    id: str
    group: str
    operation: str
    bundle: str
    inputs: Arrays
    outputs: Arrays
    tolerances: Arrays
    flags: dict[str, list[int]]
    parameters: dict[str, Any] = field(default_factory=dict)
    refusal: str = NEVER
    rows: int | None = None
    average: int = 1

    def __len__(self) -> int:
        return len(next(iter(self.inputs.values()))) // self.average if self.inputs else 1

    def sent(self) -> Arrays:
        """The inputs as they go to the host."""
        if self.rows is None:
            return self.inputs
        order = np.arange(self.rows) % len(self)
        return {name: array[order] for name, array in self.inputs.items()}

    def flags_of(self, row: int) -> list[str]:
        """The bugs that a vector hunts."""
        return [flag for flag, rows in self.flags.items() if row in rows]


@dataclass(frozen=True)
class Suite:
    """Vectors and the bundles they need.

    Arguments:
        bundles: paths by name.
    """

    sets: tuple[VectorSet, ...]
    bundles: Mapping[str, Path]

    def __add__(self, other: Suite) -> Suite:
        return Suite(self.sets + other.sets, {**self.bundles, **other.bundles})


def write(suite: Suite, folder: Path) -> None:
    """Writes index and arrays; the same suite gives the same bytes. The index comes last.

    Raises:
        PureLightError: If a file cannot be written.
    """
    entries = []
    for vectors in suite.sets:
        name = f"sets/{vectors.id.replace('/', '-')}.bin" if vectors.inputs else ""
        entry, data = _pack(vectors)
        if name:
            atomic.write_bytes(folder / name, data)
        entries.append({**entry, "file": name})
    index = {
        "version": VERSION,
        "flags": FLAGS,
        "bundles": {k: path.relative_to(folder).as_posix() for k, path in suite.bundles.items()},
        "sets": entries,
    }
    text = json.dumps(index, ensure_ascii=False, indent=1, allow_nan=False)
    atomic.write_bytes(folder / INDEX, f"{text}\n".encode())


def _pack(vectors: VectorSet) -> tuple[dict[str, Any], bytes]:
    """The entry of the index, and the arrays one behind the other."""
    entry: dict[str, Any] = {
        "id": vectors.id, "group": vectors.group, "operation": vectors.operation,
        "bundle": vectors.bundle, "parameters": vectors.parameters, "refusal": vectors.refusal,
        "rows": vectors.rows, "average": vectors.average,
        "flags": {flag: _ranges(rows) for flag, rows in vectors.flags.items()},
    }  # fmt: skip
    data = b""
    for kind, dtype in (("inputs", "<f4"), ("outputs", "<f8"), ("tolerances", "<f8")):
        entry[kind] = {}
        for name, array in getattr(vectors, kind).items():
            raw = np.ascontiguousarray(array, dtype)
            entry[kind][name] = {"dtype": dtype, "shape": list(raw.shape), "offset": len(data)}
            data += raw.tobytes()
    return entry, data


def _ranges(rows: list[int]) -> list[list[int]]:
    """Rows as pairs: first, and one beyond the last."""
    ranges: list[list[int]] = []
    for row in rows:
        if ranges and ranges[-1][1] == row:
            ranges[-1][1] = row + 1
        else:
            ranges.append([row, row + 1])
    return ranges


def read(folder: Path) -> Suite:
    """Reads a suite, which may come from anyone: nothing outside of its folder is opened.

    Raises:
        PureLightError: If there is none, it is of another version, or it is damaged.
    """
    path = folder / INDEX
    if not is_file(path):
        raise PureLightError(
            f"{path}: no such file; make the suite with purelight-conformance make"
        )
    try:
        index = json.loads(read_file(path, INDEX_BYTES), parse_constant=_refuse_constant)
        if index["version"].split(".")[0] != VERSION.split(".")[0]:
            raise PureLightError(f"{path}: version {index['version']}, this reads {VERSION}")
        sets = tuple(_unpack(entry, _content(folder, entry["file"])) for entry in index["sets"])
        bundles = {name: _inside(folder, at) for name, at in index["bundles"].items()}
        _check(sets, bundles)
        return Suite(sets, bundles)
    except FormatError as error:
        raise PureLightError(f"{path}: {error.issue.message}") from error
    except DAMAGE as error:
        raise PureLightError(f"{path}: the suite is damaged ({error!r}); make it again") from error


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _check(sets: tuple[VectorSet, ...], bundles: Mapping[str, Path]) -> None:
    """Raises ValueError where sets do not fit together, or are not what a runner can put."""
    if len({vectors.id for vectors in sets}) < len(sets):
        raise ValueError("two sets have one id")
    for vectors in sets:
        if vectors.bundle and vectors.bundle not in bundles:
            raise ValueError(f"{vectors.id}: no bundle {vectors.bundle}")
        if vectors.refusal not in (NEVER, ALLOWED, REQUIRED):
            raise ValueError(f"{vectors.id}: refusal {vectors.refusal}")
        if not isinstance(vectors.parameters, dict):
            raise ValueError(f"{vectors.id}: parameters are no object")
        count = len(vectors)
        if {len(array) for array in vectors.inputs.values()} - {count * vectors.average}:
            raise ValueError(f"{vectors.id}: inputs of different length")
        for name, array in vectors.outputs.items():
            if len(array) != count or vectors.tolerances[name].shape != array.shape:
                raise ValueError(f"{vectors.id}: {name} does not fit its inputs or tolerances")
        if any(row >= count for rows in vectors.flags.values() for row in rows):
            raise ValueError(f"{vectors.id}: a flag of a vector that there is not")


def _inside(folder: Path, name: str) -> Path:
    """A file of the suite.

    Raises:
        ValueError: It would lie elsewhere.
    """
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError(f"{name[:80]} is not in the suite's folder")
    return path


def _content(folder: Path, file: str) -> bytes:
    """The arrays of a set; sets of the group `reader` have no file."""
    return read_file(_inside(folder, file), SET_BYTES) if file else b""


def _unpack(entry: dict[str, Any], data: bytes) -> VectorSet:
    inputs, outputs, tolerances = (
        {name: _array(data, at) for name, at in entry[kind].items()}
        for kind in ("inputs", "outputs", "tolerances")
    )
    flags = {k: list(_rows(ranges)) for k, ranges in entry["flags"].items()}
    rows, average = entry["rows"], entry["average"]
    if not 0 <= (rows or 0) <= ROWS or not 1 <= average <= ROWS:
        raise ValueError(f"{rows} rows, {average} each")
    return VectorSet(
        entry["id"], entry["group"], entry["operation"], entry["bundle"], inputs, outputs,
        tolerances, flags, entry["parameters"], entry["refusal"], rows, average,
    )  # fmt: skip


def _array(data: bytes, at: dict[str, Any]) -> np.ndarray:
    count = math.prod(at["shape"])
    if at["dtype"] not in ("<f4", "<f8") or count < 0 or at["offset"] < 0:
        raise ValueError(f"an array of {at}")
    return np.frombuffer(data, at["dtype"], count, at["offset"]).reshape(at["shape"])


def _rows(ranges: list[list[int]]) -> Iterator[int]:
    for first, end in ranges:
        if not 0 <= first <= end <= ROWS:
            raise ValueError(f"rows {first} to {end}")
        yield from range(first, end)
