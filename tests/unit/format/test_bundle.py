"""Bundles on disk, and the two commands."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from purelight_format import bundle, cli
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.limits import LIMITS
from purelight_format.members.manifest import Manifest
from purelight_format.networks.kinds import KINDS
from purelight_format.validation.report import Report
from purelight_format.validation.validate import validate
from tests.assets import bad
from tests.support import lamp

SCHEMA = json.loads((Path(__file__).parents[3] / "spec/schema/report.schema.json").read_text())


@pytest.fixture
def path(tmp_path: Path) -> Path:
    bundle.write(tmp_path / "lamp.plux", *lamp.parts())
    return tmp_path / "lamp.plux"


def test_a_written_bundle_is_valid_and_comes_back(path: Path) -> None:
    assert validate(path).issues == ()
    opened, (manifest, members) = Bundle.open(path), lamp.parts()
    assert replace(opened.manifest, members={}) == manifest
    assert {name: opened.read(name) for name in members} == members
    np.testing.assert_array_equal(opened.surface().positions, lamp.surface().positions)
    assert len(opened.vectors("sampler")) == 8


def test_two_builds_are_the_same_bytes_in_whatever_order(path: Path) -> None:
    manifest, members = lamp.parts()
    again = bundle.write(path.with_name("b.plux"), manifest, dict(reversed(members.items())))
    assert again.data == path.read_bytes()


def test_the_digest_stands_for_every_member(path: Path) -> None:
    opened = Bundle.open(path)
    assert opened.digest == hashlib.sha256(opened.read("manifest.json")).hexdigest()
    manifest, members = lamp.parts()
    other = bundle.write(path, manifest, {**members, "preview.png": lamp.PNG + b"."})
    assert other.digest != opened.digest


def test_a_newer_bundle_is_read_and_written_again_with_all_it_holds(path: Path) -> None:
    """Unknown fields, networks and extensions of a newer minor version survive."""
    content = {**lamp.good(), "extensions/org.example.haze/grid.bin": b"\1\2\3"}

    def newer(root: dict[str, Any]) -> None:
        root.update(format_version="1.4", mood={"cosy": [1, 2]})
        root["networks"]["appearance"]["tier"] = "high"
        root["extensions"] = {"org.example.haze": {"density": 0.5, "grid": "grid.bin"}}

    path.write_bytes(lamp.seal(content, newer))
    report = validate(path)
    assert report.valid
    assert {issue.code.name for issue in report.issues} == {
        "PLX_MANIFEST_VERSION_NEWER", "PLX_MANIFEST_UNKNOWN_FIELD",
    }  # fmt: skip
    first = Bundle.open(path)
    kept = {name: first.read(name) for name in first.entries if name != "manifest.json"}
    again = bundle.write(path.with_name("again.plux"), first.manifest, kept)
    assert json.loads(again.read("manifest.json")) == json.loads(first.read("manifest.json"))
    assert {name: again.read(name) for name in kept} == kept


def test_an_invalid_bundle_is_not_written(path: Path) -> None:
    manifest, members = lamp.parts()
    before = path.read_bytes()
    with pytest.raises(PureLightError, match=r"not written.*PLX_PREVIEW_INVALID"):
        bundle.write(path, manifest, {**members, "preview.png": b"GIF"})
    with pytest.raises(PureLightError, match="PLX_MANIFEST_RMAX_INVALID"):
        bundle.write(path, replace(manifest, r_max=0.5), members)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_an_invalid_bundle_is_not_opened(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(PureLightError, match=r"lamp\.plux: not a valid bundle: PLX_ZIP_TRUNCATED"):
        Bundle.open(path)


def test_an_unchecked_bundle_still_has_its_digests(path: Path) -> None:
    path.write_bytes(bad.member("preview.png", b"GIF"))
    assert Bundle.open(path, validate=False).read("preview.png") == b"GIF"
    path.write_bytes(bad.edited("members/preview.png/sha256", "0" * 64))
    with pytest.raises(PureLightError, match="PLX_MANIFEST_DIGEST_MISMATCH"):
        Bundle.open(path, validate=False)


def test_a_missing_member_is_one_line(path: Path) -> None:
    with pytest.raises(PureLightError, match="no member networks/magic"):
        Bundle.open(path).read("networks/magic.onnx")


def appearance_only() -> tuple[Manifest, dict[str, bytes]]:
    """The smallest lamp that is valid."""
    manifest, members = lamp.parts()
    kept = {k: v for k, v in members.items() if "network" not in k and "vectors" not in k}
    kept |= {k: v for k, v in members.items() if "/appearance." in k}
    for name in ("photometry.ies", "preview.png"):
        del kept[name]
    return replace(manifest, networks={"appearance": manifest.networks["appearance"]}), kept


def test_a_bundle_of_one_network_is_enough(tmp_path: Path) -> None:
    opened = bundle.write(tmp_path / "small.plux", *appearance_only())
    assert list(opened.manifest.networks) == ["appearance"]


def test_a_report_is_cut_and_says_so() -> None:
    value = json.loads(lamp.good()["manifest.json"])
    value.update({f"field{k}": k for k in range(LIMITS.issues + 5)})
    report = validate(bad.manifest(json.dumps(value).encode()))
    assert len(report.issues) == LIMITS.issues
    assert report.truncated
    assert "and more" in report.to_text("x")


def test_errors_are_kept_before_warnings_when_a_report_is_cut() -> None:
    value = json.loads(lamp.good()["manifest.json"])
    value.update({f"field{k}": k for k in range(LIMITS.issues + 5)}, r_max=0)
    assert not validate(bad.manifest(json.dumps(value).encode())).valid


def run(capsys: pytest.CaptureFixture[str], *argv: str) -> tuple[int, str, str]:
    code = cli.validate_main(argv)
    out, err = capsys.readouterr()
    return code, out, err


def test_validate_says_valid(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, str(path)) == (0, f"{path}: valid (0 errors, 0 warnings)\n", "")


def test_validate_says_what_is_wrong(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path.write_bytes(bad.edited("r_max", 0))
    code, out, err = run(capsys, str(path))
    assert (code, err) == (1, "")
    assert "PLX_MANIFEST_RMAX_INVALID at manifest.json/r_max" in out
    assert "[spec/plux.md#m9]" in out
    assert out.endswith("INVALID (1 error, 0 warnings)\n")


@pytest.mark.parametrize("value", [15, 0])
def test_validate_speaks_json(path: Path, capsys: pytest.CaptureFixture[str], value: float) -> None:
    path.write_bytes(bad.edited("r_max", value))
    code, out, _ = run(capsys, str(path), "--json")
    report = json.loads(out)
    jsonschema.validate(report, SCHEMA)
    assert code == (0 if report["valid"] else 1)
    assert report["valid"] == (value == 15)


@pytest.mark.parametrize("main", [cli.validate_main, cli.inspect_main])
def test_a_missing_file_is_one_line(main: object, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nowhere.plux"]) == 2  # type: ignore[operator]
    out, err = capsys.readouterr()
    assert out == ""
    assert err.endswith("error: nowhere.plux: cannot read: No such file or directory\n")
    assert len(err.splitlines()) == 1


def test_inspect_fits_on_one_screen(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.inspect_main([str(path)]) == 0
    out = capsys.readouterr().out
    assert len(out.splitlines()) <= 30
    assert max(map(len, out.splitlines())) <= 120
    for word in ("Octahedron", "20 cm across", "radius 0.1 m", "1,607 lm; 4, 2, 1 W", "#FFBC89",
                 "yes         transparency", "be seen through", "octahedron.xml", "seed 7",
                 "relative_error 0.02", "0.05 uniform", Bundle.open(path).digest):  # fmt: skip
        assert word in out


def shown(path: Path, capsys: pytest.CaptureFixture[str], **fields: object) -> str:
    """What inspect says of a lamp with other fields in its manifest."""
    manifest, members = lamp.parts()
    bundle.write(path, replace(manifest, **fields), members)  # type: ignore[arg-type]
    assert cli.inspect_main([str(path)]) == 0
    return capsys.readouterr().out


def test_inspect_says_how_faithful_a_lamp_is(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = {
        "student_flux": [4.04, 2.0, 0.99], "student_flux_error": [0.02, 0.0, 0.0],
        "flux_error": [0.004, 0.0, 0.0], "held_out_gain_nats": 1.609,
        "onnx_error": {"appearance": 1e-6, "sampler": 2e-5}, "mood": "cosy",
    }  # fmt: skip
    out = shown(path, capsys, fidelity=figures)
    wanted = (
        "+1, +0, -1 % (R, G, B); up to 1 % may be chance",
        "random rays (standard errors: networks 0.5 %, traced light 0.1 %)",
        "5 times likelier", "within 2e-05", "mood cosy",
    )  # fmt: skip
    for words in wanted:
        assert words in out


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        ({"student_flux": [4.04, 2.0, 0.99]}, "+1, +0, -1 % (R, G, B)"),
        ({"flux_error": [0.004, 0, 0]}, "relative to the lamp's flux: traced light 0.1 %"),
        ({"student_flux": [8, 2, 1], "flux_error": "unknown"}, "+100, +0, +0 % (R, G, B)"),
    ],
)
def test_inspect_says_what_it_knows_of_the_brightness(
    path: Path, capsys: pytest.CaptureFixture[str], figures: dict[str, object], words: str
) -> None:
    out = shown(path, capsys, fidelity=figures)
    assert words in out
    assert "chance" not in out


@pytest.mark.parametrize("wrong", ["text", [1, 2], [True] * 3, {"a": "b"}, None, 1e999, []])
def test_inspect_shows_figures_of_any_form(
    path: Path, capsys: pytest.CaptureFixture[str], wrong: object
) -> None:
    known = "student_flux", "student_flux_error", "flux_error", "held_out_gain_nats", "onnx_error"
    if wrong == 1e999:
        wrong = 1e308
    assert "faithful" in shown(path, capsys, fidelity=dict.fromkeys(known, wrong))


def test_inspect_says_what_a_lamp_cannot_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "small.plux"
    smallest, kept = appearance_only()
    bundle.write(path, smallest, kept)
    assert cli.inspect_main([str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    cannot = [line.split()[1] for line in lines if line.startswith("  no")]
    assert cannot == [name for name, kind in KINDS.items() if kind.ability and not kind.required]
    assert cannot[:3] == ["transparency", "sampler", "fast_map"]


def test_inspect_speaks_json(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.inspect_main([str(path), "--json"]) == 0
    value = json.loads(capsys.readouterr().out)
    assert value["triangles"] == 8
    assert value["bytes"] == path.stat().st_size
    assert value["manifest"]["name"] == "Octahedron"


def test_inspect_refuses_what_is_invalid(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path.write_bytes(b"no bundle")
    assert cli.inspect_main([str(path)]) == 2
    assert "PLX_ZIP_BAD_SIGNATURE" in capsys.readouterr().err


def test_an_empty_report_is_valid() -> None:
    assert Report().exit_code == 0
