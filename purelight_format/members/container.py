"""The stored zip that a bundle is: a byte-deterministic writer, and a scanner that accepts only
what the writer would have written."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from typing import BinaryIO

from purelight_format.issues import fail
from purelight_format.limits import LIMITS, Limits

Buffer = bytes | memoryview

ALIGNMENT = 64
PADDING_ID = 0x1986  # The extra field that OpenUSD pads its packages with.
DEVICES = "(?:aux|con|nul|prn|com[0-9]|lpt[0-9])"  # On Windows, whatever their ending.
PART = re.compile(rf"(?!{DEVICES}(?:\.|$))[a-z0-9_](?:[a-z0-9_.-]*[a-z0-9_-])?")

LOCAL = struct.Struct("<4s5H3I2H")
CENTRAL = struct.Struct("<4s6H3I5H2I")
END = struct.Struct("<4s4H2IH")
LOCAL_SIGNATURE, CENTRAL_SIGNATURE, END_SIGNATURE = b"PK\3\4", b"PK\1\2", b"PK\5\6"

NEEDED = 10  # Version 1.0 of the zip specification: stored members.
MADE_BY = 0x0314  # Unix, so that the attributes below are a file mode.
DATE = 0x0021  # 1980-01-01; the time is midnight.
MODE = 0o100644 << 16
ENCRYPTED, DESCRIPTOR = 1, 8
ZIP64 = 0xFFFFFFFF


@dataclass(frozen=True)
class Entry:
    """Where a member lies.

    Arguments:
        name: path inside the bundle.
        header: offset of its local header.
        start: offset of its data, a multiple of 64.
        size: bytes of data.
        crc: CRC-32 of the data.
    """

    name: str
    header: int
    start: int
    size: int
    crc: int


# Writing


def write(file: BinaryIO, members: Mapping[str, bytes]) -> None:
    """Writes members in their order; the same members give the same bytes.

    Raises:
        FormatError: If a name or a size breaks a rule of the container.
    """
    entries: list[Entry] = []
    offset = 0
    for name, data in members.items():
        _require_name(name, {entry.name for entry in entries})
        start = offset + LOCAL.size + len(name) + len(_padding(offset, name))
        entry = Entry(name, offset, start, len(data), zlib.crc32(data))
        if start + len(data) > LIMITS.file_bytes:
            fail("PLX_FILE_TOO_LARGE", name, size=start + len(data), limit=LIMITS.file_bytes)
        file.write(_local(entry))
        file.write(data)
        entries.append(entry)
        offset = start + len(data)
    if len(entries) > LIMITS.members:
        fail("PLX_ZIP_TOO_MANY_MEMBERS", "file", count=len(entries), limit=LIMITS.members)
    directory = b"".join(_central(entry) for entry in entries)
    file.write(directory + _end(len(entries), len(directory), offset))


def pack(members: Mapping[str, bytes]) -> bytes:
    """Returns what `write` writes."""
    file = BytesIO()
    write(file, members)
    return file.getvalue()


def _padding(offset: int, name: str) -> bytes:
    """The extra field that moves the data of a member to a multiple of 64."""
    size = -(offset + LOCAL.size + len(name)) % ALIGNMENT
    if 0 < size < 4:  # The field has a header of four bytes itself.
        size += ALIGNMENT
    return struct.pack("<2H", PADDING_ID, size - 4) + bytes(size - 4) if size else b""


def _local(entry: Entry) -> bytes:
    name, padding = entry.name.encode(), _padding(entry.header, entry.name)
    fixed = LOCAL.pack(
        LOCAL_SIGNATURE, NEEDED, 0, 0, 0, DATE,
        entry.crc, entry.size, entry.size, len(name), len(padding),
    )  # fmt: skip
    return fixed + name + padding


def _central(entry: Entry) -> bytes:
    name = entry.name.encode()
    fixed = CENTRAL.pack(
        CENTRAL_SIGNATURE, MADE_BY, NEEDED, 0, 0, 0, DATE,
        entry.crc, entry.size, entry.size, len(name), 0, 0, 0, 0, MODE, entry.header,
    )  # fmt: skip
    return fixed + name


def _end(count: int, size: int, offset: int) -> bytes:
    return END.pack(END_SIGNATURE, 0, 0, count, count, size, offset, 0)


# Reading


def scan(data: bytes, limits: Limits = LIMITS) -> dict[str, Entry]:
    """Walks a bundle from its first byte to its last.

    Accepts exactly the files that `write` makes, so that no two readers can disagree about what
    a file holds: nothing hidden between members, no second meaning of a name.

    Arguments:
        data: the whole file.
        limits: what is accepted.

    Returns:
        The members in file order.

    Raises:
        FormatError: With a PLX_FILE or PLX_ZIP code.
    """
    if len(data) > limits.file_bytes:
        fail("PLX_FILE_TOO_LARGE", "file", size=len(data), limit=limits.file_bytes)
    count, offset = _read_end(data)
    entries: dict[str, Entry] = {}
    position = 0
    while position < offset:
        entry = _read_local(data, position, offset)
        _require_name(entry.name, entries, limits)
        entries[entry.name] = entry
        position = entry.start + entry.size
        if len(entries) > limits.members:
            fail("PLX_ZIP_TOO_MANY_MEMBERS", "file", count=len(entries), limit=limits.members)
    _read_directory(data, offset, list(entries.values()), count)
    for entry in entries.values():
        if zlib.crc32(member(data, entry)) != entry.crc:
            fail("PLX_ZIP_CRC", entry.name)
    return entries


def member(data: bytes, entry: Entry) -> memoryview:
    """The bytes of a member, without a copy."""
    return memoryview(data)[entry.start : entry.start + entry.size]


def _read_end(data: bytes) -> tuple[int, int]:
    """Number of members and offset of the directory, from the last 22 bytes."""
    start = len(data) - END.size
    if start < 0 or data[start : start + 4] != END_SIGNATURE:
        _explain_end(data)
    _, disk, first_disk, here, count, size, offset, comment = END.unpack(data[start:])
    if comment:
        fail("PLX_ZIP_COMMENT", f"byte {start}")
    if ZIP64 in (size, offset) or 0xFFFF in (here, count):
        fail("PLX_ZIP_ZIP64", f"byte {start}")
    if disk or first_disk or here != count:
        fail("PLX_ZIP_HEADER_MISMATCH", f"byte {start}", field="several disks")
    if offset + size != start:
        fail("PLX_ZIP_HEADER_MISMATCH", f"byte {start}", field="place of the directory")
    return count, offset


def _explain_end(data: bytes) -> None:
    """Says why the file does not end with an end record."""
    if data[:4] not in (LOCAL_SIGNATURE, END_SIGNATURE):
        fail("PLX_ZIP_BAD_SIGNATURE", "byte 0")
    found = data.rfind(END_SIGNATURE)
    if found < 0 or found + END.size > len(data):
        fail("PLX_ZIP_TRUNCATED", f"byte {len(data)}")
    extra = len(data) - found - END.size
    if int.from_bytes(data[found + END.size - 2 : found + END.size], "little") == extra:
        fail("PLX_ZIP_COMMENT", f"byte {found}")
    fail("PLX_ZIP_TRAILING_DATA", f"byte {found + END.size}", size=extra)


def _read_local(data: bytes, position: int, limit: int) -> Entry:
    """Reads a local header, which must be the one that the writer makes."""
    where = f"byte {position}"
    if data[position : position + 4] != LOCAL_SIGNATURE:
        fail("PLX_ZIP_GAP" if position else "PLX_ZIP_BAD_SIGNATURE", where)
    if position + LOCAL.size > limit:
        fail("PLX_ZIP_OVERLAP", where)
    (_, needed, flags, method, time, date, crc, packed, size, name_size, extra_size) = (
        LOCAL.unpack_from(data, position)
    )
    _require_plain(where, flags, method, packed, size)
    _require_canonical(where, {"version": (needed, NEEDED), "flags": (flags, 0),
                               "time": (time, 0), "date": (date, DATE)})  # fmt: skip
    name_start = position + LOCAL.size
    start = name_start + name_size + extra_size
    if start + size > limit:
        fail("PLX_ZIP_OVERLAP", where)
    name = data[name_start : name_start + name_size].decode("latin-1")
    if start % ALIGNMENT:
        fail("PLX_ZIP_MISALIGNED", name, offset=start)
    if data[name_start + name_size : start] != _padding(position, name):
        fail("PLX_ZIP_GAP", f"byte {name_start + name_size}")
    return Entry(name, position, start, size, crc)


def _require_plain(where: str, flags: int, method: int, packed: int, size: int) -> None:
    if flags & ENCRYPTED:
        fail("PLX_ZIP_ENCRYPTED", where)
    if flags & DESCRIPTOR:
        fail("PLX_ZIP_DATA_DESCRIPTOR", where)
    if method:
        fail("PLX_ZIP_COMPRESSED", where, method=method)
    if ZIP64 in (packed, size):
        fail("PLX_ZIP_ZIP64", where)
    if packed != size:
        fail("PLX_ZIP_HEADER_MISMATCH", where, field="compressed size of a stored member")


def _require_canonical(where: str, fields: Mapping[str, tuple[int, int]]) -> None:
    for field, (value, expected) in fields.items():
        if value != expected:
            fail("PLX_ZIP_NOT_CANONICAL", where, field=field, value=value, expected=expected)


def _require_name(
    name: str, earlier: Mapping[str, Entry] | set[str], limits: Limits = LIMITS
) -> None:
    parts = name.split("/")
    longest = max(map(len, parts))
    if len(parts) > limits.name_depth or longest > limits.name_part_bytes:
        fail("PLX_ZIP_NAME_INVALID", "directory", name=name[:80])
    if not all(PART.fullmatch(part) for part in parts):
        fail("PLX_ZIP_NAME_INVALID", "directory", name=name[:80])
    folders = {"/".join(parts[:k]) for k in range(1, len(parts))}
    if any(o == name or o in folders or o.startswith(name + "/") for o in earlier):
        fail("PLX_ZIP_NAME_DUPLICATE", "directory", name=name)


def _read_directory(data: bytes, offset: int, entries: list[Entry], count: int) -> None:
    """The directory must say what the local headers say, in their order."""
    if count != len(entries):
        fail("PLX_ZIP_HEADER_MISMATCH", "directory", field="number of members")
    for entry in entries:
        expected = _central(entry)
        found = data[offset : offset + len(expected)]
        if found != expected:
            _explain_central(found, expected, entry.name)
        offset += len(expected)
    if offset != len(data) - END.size:
        fail("PLX_ZIP_GAP", f"byte {offset}")


def _explain_central(found: bytes, expected: bytes, name: str) -> None:
    """Says which field of a directory record is not the member's."""
    if len(found) < CENTRAL.size:
        fail("PLX_ZIP_HEADER_MISMATCH", name, field="the record is missing")
    names = (
        "signature", "version made by", "version", "flags", "method", "time", "date", "CRC-32",
        "compressed size", "size", "name", "extra field", "comment", "disk",
        "internal attributes", "attributes", "offset",
    )  # fmt: skip
    pairs = zip(
        names,
        CENTRAL.unpack(found[: CENTRAL.size]),
        CENTRAL.unpack(expected[: CENTRAL.size]),
        strict=True,
    )
    different = [field for field, a, b in pairs if a != b]
    if different == ["attributes"]:
        fail("PLX_ZIP_NOT_REGULAR", name)
    fail("PLX_ZIP_HEADER_MISMATCH", name, field=", ".join(different) or "name")
