"""The stored zip: the same content gives the same bytes, and only those bytes are accepted."""

from __future__ import annotations

import io
import zipfile

import pytest

from purelight_format.issues import FormatError
from purelight_format.members import container
from tests.support import lamp

MEMBERS = {"a.usda": b"", "b/c.bin": bytes(range(256)), "x" * 64: b"1", "d/e/f/g.txt": b"text" * 99}


def read(data: bytes) -> dict[str, bytes]:
    entries = container.scan(data)
    return {name: bytes(container.member(data, entry)) for name, entry in entries.items()}


def test_members_come_back_in_order() -> None:
    found = read(container.pack(MEMBERS))
    assert list(found.items()) == list(MEMBERS.items())


def test_data_begins_at_multiples_of_64() -> None:
    for length in range(1, 64):  # Every possible fill of the padding.
        data = container.pack({"n" * length: b"data", "second": b"x" * length})
        assert all(entry.start % 64 == 0 for entry in container.scan(data).values())


def test_the_same_content_gives_the_same_bytes() -> None:
    assert lamp.seal(lamp.good()) == lamp.seal(lamp.good())
    assert container.pack(MEMBERS) == container.pack(dict(MEMBERS))


def test_other_zip_readers_agree() -> None:
    data = lamp.seal(lamp.good())
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        assert {info.filename: archive.read(info) for info in archive.infolist()} == read(data)
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {info.external_attr >> 16 for info in archive.infolist()} == {0o100644}


def test_an_archive_of_another_writer_is_refused() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("a.txt", b"text")
    with pytest.raises(FormatError, match="PLX_ZIP_"):
        container.scan(file.getvalue())


def test_every_truncation_is_refused() -> None:
    data = container.pack(MEMBERS)
    for size in range(len(data)):
        with pytest.raises(FormatError, match="PLX_ZIP_"):
            container.scan(data[:size])


def test_every_changed_byte_is_refused() -> None:
    """No byte of the file is without meaning, so none can carry a second one."""
    data = container.pack(MEMBERS)
    for offset in range(len(data)):
        spoilt = bytearray(data)
        spoilt[offset] ^= 0x41
        try:
            found = read(bytes(spoilt))
        except FormatError:
            continue
        assert container.pack(found) == bytes(spoilt)  # Another valid name, and nothing else.
        assert list(found.values()) == list(MEMBERS.values())


@pytest.mark.parametrize("name", ["", "A", "a//b", "../a", "a/..", ".a", "a b", "ä", "a/b/c/d/e"])
def test_names_that_a_host_may_misread_are_not_written(name: str) -> None:
    with pytest.raises(FormatError, match="PLX_ZIP_NAME_INVALID"):
        container.pack({name: b""})


def test_an_empty_archive_is_canonical() -> None:
    assert read(container.pack({})) == {}
