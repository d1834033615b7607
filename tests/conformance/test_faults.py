"""Faults planted in a host are caught by the vectors that hunt them, and by no control."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from purelight_conformance import runner, sampling
from purelight_conformance.protocol import READER
from purelight_conformance.results import FAILED
from purelight_conformance.suite import Suite
from tests.conformance.faulty_host import FAULTS

HOST = Path(__file__).with_name("faulty_host.py")
# The flag that hunts each fault; the part of its vectors that must fail; sets that must pass.
HUNTED = {
    "axis_order": ("AXIS_ORDER", 0.9, {"appearance/paint", "fast_map/paint", "frames/axes"}),
    "cosine_measure": ("MEASURE", 0.2, {"sampler/wild", "appearance/wild", "cap/cap-near"}),
    "cancellation": ("CANCELLATION", 0.5, {"frames/axes", "cap/square_to_disk"}),
    "transposed_map": ("MAP_ORDER", 0.7, {"fast_map/paint", "appearance/compass"}),
    "tf32": ("PRECISION", 0.5, {"frames/axes", "cap/cap-near", "appearance/paint"}),
    "swapped_channels": ("CHANNEL_ORDER", 0.9, {"appearance/compass", "fast_map/compass"}),
    "unturned_normal": ("NORMAL_SIDE", 0.8, {"appearance/wild", "sampler/wild"}),
    "schlick": ("FINISH", 0.4, {"finishes/matt", "appearance/wild"}),
    "transposed_rotation": ("ROTATION", 0.8, {"appearance/wild", "composite/view-wild"}),
    "scaled_radiance": ("SCALE", 0.4, {"instance/radiance-turned", "composite/view-wild"}),
    "uniform_transform_only_in_name": ("REFUSE", 0.5, {"instance/radiance-scaled"}),
    "takes_everything": ("UNVETTED", 1.0, {"reader/wild", "reader/onnx_metadata"}),
    "refuses_everything": ("OVERSTRICT", 1.0, {"frames/axes", "reader/zip_gap"}),
    "swapped_square": ("DISTRIBUTION", 1.0, {"statistics/integral", "sampler_pdf/wild"}),
    "unnormalised": ("UNNORMALISED", 1.0, {"statistics/distribution", "appearance/wild"}),
    "uneven_by_a_hundredth": ("REFUSE", 0.2, {"instance/uneven", "instance/radiance-scaled"}),
    "even_to_the_last_digit": ("ROTATION", 0.1, {"instance/radiance-turned", "instance/shear"}),
    "map_in_the_luminaire_frame": (
        "ROTATION",
        0.01,
        {"estimators/map-compass", "fast_map/compass"},
    ),
    "mirrored_map": ("MAP_ORDER", 0.5, {"fast_map/compass", "estimators/sampled-wild"}),
    "divides_by_no_density": ("INSIDE", 0.2, {"sampler/wild", "estimators/map-compass"}),
    "enters_at_the_sphere": ("WITHIN", 0.9, {"composite/view-wild", "composite/view-placed"}),
    "refuses_warnings": ("OVERSTRICT", 0.4, {"reader/wild", "reader/zip_gap"}),
}
LAMPS = ("", "wild", "compass", "paint")


@pytest.fixture(scope="module")
def part(whole: Suite) -> Suite:
    """The suite without what is evaluated of hard cases, which no fault is about."""
    sets = tuple(
        v for v in whole.sets if v.group == READER or (v.bundle in LAMPS and v.rows is None)
    )
    return Suite(sets, whole.bundles)


def test_every_fault_has_a_flag() -> None:
    assert HUNTED.keys() == FAULTS.keys()


def test_the_host_without_a_fault_passes(part: Suite) -> None:
    report = runner.run(part, [sys.executable, str(HOST)])
    assert report.conforms
    assert report.groups()["statistics"]["passed"] == 2 * len(sampling.RADII)


@pytest.mark.parametrize("fault", HUNTED)
def test_a_planted_fault_is_caught(fault: str, part: Suite) -> None:
    flag, least, controls = HUNTED[fault]
    statistics = any(flag == hunted for _, hunted, _ in sampling.TESTS.values())
    report = runner.run(part, [sys.executable, str(HOST), fault], statistics=statistics)
    assert not report.fault
    assert not report.conforms
    failed, checked = report.caught()[flag]
    assert failed >= least * checked
    assert any(flag in failure.hunts for failure in report.failures)
    by_set = {result.vectors.id: result.outcome for result in report.results}
    assert all(FAILED not in by_set[control] for control in controls)


def test_a_file_that_should_be_refused_is_named_with_its_issue(part: Suite) -> None:
    host = [sys.executable, str(HOST), "takes_everything"]
    report = runner.run(part, host, statistics=False)
    said = {failure.vector: failure.what for failure in report.failures}
    assert said["reader/zip_gap/0"] == "was answered, but must be refused: PLX_ZIP_GAP"
