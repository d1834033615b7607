"""EULUMDAT files: written, read back by others, and read as they come."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from photompy import LDTFile
from pyldt import LdtReader

from purelight_format.errors import PureLightError
from purelight_format.photometry.eulumdat_reader import eulumdat_photometry
from purelight_format.photometry.eulumdat_writer import eulumdat_text
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.opening import BALL, BOX, DRUM, Opening
from purelight_format.photometry.table import IntensityTable, node_solid_angle
from tests.support.distributions import FULL, VERTICAL, lamp, skewed

SIZE = (0.31, 1.21, 0.1)
LAMP = lamp()


def written(of: LampPhotometry = LAMP) -> bytes:
    return eulumdat_text(of, maker="Maker", issued="2026-01-01", size=SIZE)


TEXT = written().decode()
LINES = TEXT.split("\r\n")


def same(data: bytes, factor: float = 1.0) -> None:
    found = eulumdat_photometry(data, "lamp").table
    angles, rows = found.whole
    np.testing.assert_allclose(angles, FULL)
    np.testing.assert_allclose(rows, LAMP.table.candela * factor, rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("kind", range(5))
def test_every_symmetry_goes_out_and_in(kind: int) -> None:
    table = skewed(FULL, kind)
    data = written(lamp(table))
    assert data.split(b"\r\n")[2] == str(kind).encode()
    found = eulumdat_photometry(data, "lamp")
    assert found.notes == ()
    angles, rows = found.table.whole
    np.testing.assert_allclose(rows, skewed(angles, kind).candela, rtol=1e-5, atol=1e-2)


@pytest.mark.parametrize("kind", range(5))
def test_another_library_reads_it_back(kind: int, tmp_path: Path) -> None:
    table = skewed(FULL, kind)
    path = tmp_path / "lamp.ldt"
    path.write_bytes(written(lamp(table)))
    other = LdtReader.read(path)
    weight = node_solid_angle(np.array(other.header.g_angles))
    total = np.array(other.intensities).mean(0) @ weight * other.header.lamp_flux[0] / 1000
    assert total == pytest.approx(table.flux, rel=1e-4)
    about = other.header
    assert (about.length, about.width, about.height) == (1210, 310, 100)
    assert (about.length_lum_area, about.width_lum_area) == (1200, 300)
    assert (about.h_lum_c0, about.h_lum_c90, about.h_lum_c180, about.h_lum_c270) == (0, 10, 20, 30)
    assert about.num_lamps == [-1]
    assert about.lamp_watt == [40]


@pytest.mark.parametrize("kind", [0, 1])
def test_a_second_one_finds_the_same_intensities(kind: int, tmp_path: Path) -> None:
    table = skewed(FULL, kind)
    path = tmp_path / "lamp.ldt"
    path.write_bytes(written(lamp(table)))
    values = np.asarray(LDTFile.read(path).photometry.values)
    np.testing.assert_allclose(values, table.candela[: len(values)], rtol=1e-4, atol=1e-3)


def test_planes_that_fit_no_symmetry_are_all_written() -> None:
    table = skewed(np.array([0.0, 25, 60, 180, 300, 335, 360]), 2)
    data = written(lamp(table))
    assert data.split(b"\r\n")[2] == b"0"
    np.testing.assert_allclose(
        eulumdat_photometry(data, "x").table.whole[1], table.candela, rtol=1e-5
    )


def test_a_faint_and_a_dark_lamp() -> None:
    faint = lamp(skewed().scaled(1e-7))
    assert eulumdat_photometry(written(faint), "x").table.flux == pytest.approx(
        faint.table.flux, rel=1e-4
    )
    dark = IntensityTable(VERTICAL, np.zeros(1), np.zeros((1, 37)))
    assert eulumdat_photometry(written(lamp(dark)), "x").table.flux == 0


@pytest.mark.parametrize(
    ("opening", "shape"),
    [(Opening(0.2, 0.4, (0.1,) * 4, BOX), BOX), (Opening(0.2, 0.2, (0.1,) * 4, DRUM), DRUM),
     (Opening(0.2, 0.2, (0.2,) * 4, BALL), DRUM)],
)  # fmt: skip
def test_openings_show_the_same_area(opening: Opening, shape: str) -> None:
    found = eulumdat_photometry(
        written(LampPhotometry("x", skewed(), opening)), "x"
    ).opening  # fmt: skip
    assert found.shape == shape
    for gamma in (0.0, 90.0):
        at = np.array([gamma]), np.array([0.0])
        assert found.projected_area(*at)[0] == pytest.approx(opening.projected_area(*at)[0], 0.01)


ODD = {
    "lf": TEXT.replace("\r\n", "\n").encode(),
    "cr": TEXT.replace("\r\n", "\r").encode(),
    "byte order mark": b"\xef\xbb\xbf" + TEXT.encode(),
    "decimal commas": TEXT.replace(".", ",").encode(),
    "latin-1": TEXT.replace("Maker", "Müller & Söhne").encode("latin-1"),
    "utf-8": TEXT.replace("Maker", "Müller & Söhne").encode(),
    "blanks": TEXT.replace("\r\n", "  \t\r\n   ").encode(),
    "trailing words": (TEXT + "END\r\n1 2 3\r\n").encode(),
    "trailing zeros": (TEXT + "0\r\n0\r\n").encode(),
    "dos end": (TEXT + "\x1a").encode(),
    "no ratios": "\r\n".join(LINES[:32] + LINES[42:]).encode(),
    "no lamps' details": "\r\n".join(LINES[:29] + LINES[42:]).encode(),
    "several values a line": "\r\n".join([*LINES[:42], " ".join(LINES[42:])]).encode(),
}


@pytest.mark.parametrize("data", ODD.values(), ids=ODD)
def test_odd_files_hold_the_same_table(data: bytes) -> None:
    same(data)


def test_all_planes_may_be_stored_whatever_the_symmetry() -> None:
    table = skewed(FULL, 4)
    whole = written(lamp(table)).decode().split("\r\n")
    stored = whole[: 42 + 24 + 37]
    values = [f"{x:.9g}" for row in table.candela[:-1] * 1000 / table.flux for x in row]
    found = eulumdat_photometry("\r\n".join(stored + values).encode(), "x").table
    np.testing.assert_allclose(found.whole[1], table.candela, rtol=1e-5)


@pytest.mark.parametrize("kind", [2, 3, 4])
def test_stored_planes_may_be_the_only_ones_listed(kind: int) -> None:
    table = skewed(FULL, kind)
    lines = written(lamp(table)).decode().split("\r\n")
    first, count = {2: (0, 13), 3: (18, 13), 4: (0, 7)}[kind]
    listed = [lines[42 + (first + k) % 24] for k in range(count)]
    data = "\r\n".join([*lines[:42], *listed, *lines[42 + 24 :]])
    np.testing.assert_allclose(
        eulumdat_photometry(data.encode(), "x").table.whole[1], table.candela, atol=1e-2
    )


def changed(**lines: str) -> bytes:
    """The file with other lines, by their numbers from 1."""
    new = list(LINES)
    for number, text in lines.items():
        new[int(number[1:]) - 1] = text
    return "\r\n".join(new).encode()


def test_lamps_and_factors() -> None:
    same(changed(_29="2000", _24="1.5"), 2000 * 1.5 / LAMP.table.flux)
    lamps = eulumdat_photometry(changed(_27="2", _29="2000"), "x")
    assert lamps.lamp_lumens == 2000
    assert eulumdat_photometry(changed(), "x").lamp_lumens is None


def test_the_first_of_several_sets_counts() -> None:
    sets = [*LINES[:25], "2", *LINES[26:32], "1", "other", "1", "", "", "7", *LINES[32:]]
    found = eulumdat_photometry("\r\n".join(sets).encode(), "x")
    assert "2 sets" in found.notes[0]
    assert found.watts == 40
    same("\r\n".join(sets).encode())


def test_what_the_header_says_is_compared() -> None:
    (note,) = eulumdat_photometry(changed(_23="50"), "x").notes
    assert "the table counts" in note
    (note,) = eulumdat_photometry(changed(_25="30"), "x").notes
    assert "tilt of 30" in note


@pytest.mark.parametrize(
    ("data", "message"),
    [(b"", "0 C planes|no 1 planes|angles"), (b"\xff" * 400, "not EULUMDAT"),
     (changed(_3="7"), "7 as symmetry"), (changed(_3="-1"), "symmetry"),
     (changed(_4="99999999"), "C planes"), (changed(_4="1048576", _6="1048576"), "planes of"),
     (changed(_6="1e12"), "angles G"), (changed(_26="21"), "sets of lamps"),
     (TEXT[: len(TEXT) // 2].encode(), "no 24 planes"),
     (b"<html>\n" * 90, "not EULUMDAT")],
)  # fmt: skip
def test_what_is_no_eulumdat_file_is_refused_in_a_line(data: bytes, message: str) -> None:
    with pytest.raises(PureLightError, match=f"lamp.ldt: .*({message})"):
        eulumdat_photometry(data, "lamp.ldt")
