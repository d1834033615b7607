"""Limits that a caller lowers: the good lamp is refused by each, with the limit's own code."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest

from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.limits import LIMITS, Limits
from purelight_format.validation.validate import examine, validate
from tests.assets import bad
from tests.support import lamp

# A value just below what the good lamp has, and the code that says so.
LOWERED = {
    "file_bytes": (1000, "PLX_FILE_TOO_LARGE"),
    "members": (3, "PLX_ZIP_TOO_MANY_MEMBERS"),
    "name_depth": (1, "PLX_ZIP_NAME_INVALID"),
    "name_part_bytes": (5, "PLX_ZIP_NAME_INVALID"),
    "manifest_bytes": (1000, "PLX_JSON_TOO_LARGE"),
    "json_depth": (2, "PLX_JSON_TOO_DEEP"),
    "json_number_digits": (2, "PLX_JSON_NON_FINITE"),
    "network_bytes": (500, "PLX_ONNX_TOO_LARGE"),
    "network_structure_bytes": (100, "PLX_ONNX_TOO_LARGE"),
    "nodes": (3, "PLX_ONNX_TOO_LARGE"),
    "initializers": (1, "PLX_ONNX_TOO_LARGE"),
    "node_inputs": (2, "PLX_ONNX_ATTRIBUTE"),
    "node_outputs": (0, "PLX_ONNX_ATTRIBUTE"),
    "tensor_rank": (1, "PLX_ONNX_TENSOR_DATA"),
    "sample_floats": (7, "PLX_ONNX_COST"),
    "sample_floats_sum": (9, "PLX_ONNX_COST"),
    "sample_macs": (5, "PLX_ONNX_COST"),
    "sample_nanoseconds": (100, "PLX_ONNX_COST"),
    "array_bytes": (100, "PLX_NPY_TOO_LARGE"),
    "crowding": (1, "PLX_SURFACE_CROWDED"),
    "finishes": (0, "PLX_MANIFEST_FINISH_COUNT"),
    "vectors": (7, "PLX_GOLDEN_SHAPE"),
    "golden_milliseconds": (0, "PLX_GOLDEN_COST"),
    "layer_bytes": (1000, "PLX_MEMBER_TOO_LARGE"),
    "layer_words": (10, "PLX_USD_TOO_COMPLEX"),
    "layer_depth": (1, "PLX_USD_TOO_DEEP"),
    "picture_bytes": (10, "PLX_MEMBER_TOO_LARGE"),
    "picture_pixels": (0, "PLX_PREVIEW_TOO_LARGE"),
}


def lowered(name: str, value: int) -> Limits:
    return Limits(**{name: value})


@pytest.mark.parametrize("name", LOWERED)
def test_a_lowered_limit_is_kept(name: str, tmp_path: Path) -> None:
    value, code = LOWERED[name]
    path = tmp_path / "lamp.plux"
    path.write_bytes(bad.finished(bad.FINISH) if name == "finishes" else lamp.seal_as_written())
    limits = lowered(name, value)
    for report in (validate(path, limits), validate(path.read_bytes(), limits)):
        assert code in {issue.code.name for issue in report.errors}
    with pytest.raises(PureLightError, match=code):
        Bundle.open(path, limits=limits)


def test_every_limit_can_be_lowered() -> None:
    assert {field.name for field in fields(Limits)} == {*LOWERED, "issues"}


def test_a_report_can_be_shorter() -> None:
    report = examine(
        bad.manifest(b'{"format_version": "1.0", "x": 1}'), limits=Limits(issues=1)
    ).report
    assert len(report.issues) == 1
    assert report.truncated
    assert not report.valid


def test_a_report_cannot_be_so_short_that_it_hides_an_error() -> None:
    with pytest.raises(PureLightError, match="issues"):
        Limits(issues=0)


@pytest.mark.parametrize("name", [field.name for field in fields(Limits)])
def test_no_limit_can_be_raised(name: str) -> None:
    for value in (getattr(LIMITS, name) + 1, -1, 0.5):
        with pytest.raises(PureLightError, match=f"the limit {name} cannot be"):
            lowered(name, value)  # type: ignore[arg-type]
