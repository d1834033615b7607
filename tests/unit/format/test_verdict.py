"""A verdict's figures survive a manifest, and its words follow from them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from purelight_format import bundle, cli
from purelight_format.issues import Severity
from purelight_format.validation.validate import validate
from purelight_format.verdict import caption, words
from purelight_format.verdict.figures import Places, Verdict, Zones, read
from purelight_format.verdict.words import judge
from tests.support import lamp
from tests.support.verdicts import FINE


def with_look(**changes: float) -> Verdict:
    assert FINE.look is not None
    return replace(FINE, look=replace(FINE.look, **changes))


def with_mode(mode: str, **changes: Any) -> Verdict:
    return replace(FINE, **{mode: replace(getattr(FINE, mode), **changes)})


# Figures


def test_figures_come_back() -> None:
    assert read(json.loads(json.dumps(FINE.to_json()))) == FINE
    few = replace(FINE, fast=None, near=None, look=None, grain=None)
    assert set(few.to_json()) == {"photons", "accurate", "share", "pattern"}
    assert read(few.to_json()) == few


def test_figures_have_four_digits() -> None:
    assert with_mode("accurate", within=0.0123456).to_json()["accurate"]["within"] == 0.01235
    assert FINE.to_json()["photons"] == 8388608


def test_what_a_newer_version_adds_is_ignored() -> None:
    value = FINE.to_json()
    value["mood"] = "cosy"
    value["look"]["gloss"] = [1, 2]
    assert read(value) == FINE


@pytest.mark.parametrize("wrong", [None, "0.1", True, [0.1], {}, -1.0, 1e300, float("nan")])
@pytest.mark.parametrize("field", ["accurate/within", "look/error", "fast/noise", "photons"])
def test_what_is_not_in_the_form_is_no_verdict(field: str, wrong: Any) -> None:
    value = FINE.to_json()
    *parents, last = field.split("/")
    at = value
    for key in parents:
        at = at[key]
    at[last] = wrong
    assert read(value) is None


@pytest.mark.parametrize("value", [None, 3, "good", [], {}, {"accurate": {}}])
def test_other_things_are_no_verdict(value: Any) -> None:
    assert read(value) is None


def test_errors_may_be_negative_and_sizes_may_not() -> None:
    assert read(with_mode("accurate", mean=-0.2).to_json()) is not None
    assert read(with_mode("accurate", noise=-0.2).to_json()) is None


def test_a_bundle_keeps_what_concerns_its_networks() -> None:
    kept = FINE.of_networks(["appearance", "sampler", "sampler_pdf"])
    assert (kept.fast, kept.grain) == (None, 1.5)
    assert FINE.of_networks(["appearance"]).grain is None
    assert FINE.of_networks(["sampler", "fast_map"]) == FINE


# Words


def test_a_good_lamp_is_said_to_be_good() -> None:
    told = judge(FINE, {"preset": "draft"})
    assert (told.light, told.look, told.fast) == ("good", "crisp", True)
    assert told.lines[0].startswith("light in the room within ±3 % (good), right in the mean")
    assert "within ±4 % between its own parts" in told.lines[0]
    assert told.lines[1].startswith("look: crisp, keeps 95 % of details of 1/64 of its width, ")
    assert "dark parts 10 % too bright, pictures 5 % off" in told.lines[1]
    assert told.lines[2] == "fast mode: recommended, within ±6 %, right in the mean"
    assert len(told.lines) == 3
    assert told.caption == "light ±3 %, crisp, fast mode ok"


@pytest.mark.parametrize(
    ("within", "light"),
    [(0.0, "good"), (0.05, "good"), (0.051, "fair"), (0.15, "fair"), (0.2, "poor")],
)
def test_light_is_judged_by_how_far_it_is_off(within: float, light: str) -> None:
    told = judge(with_mode("accurate", within=within), {"preset": "draft"})
    assert told.light == light
    assert f"({light})" in told.lines[0]
    assert any("--preset standard" in line for line in told.lines) == (light != "good")


def test_a_zone_that_is_off_is_named_with_its_light() -> None:
    told = judge(with_mode("accurate", zones=Zones(0.0, -0.01, -0.12)))
    assert "-12 % above it (30 % of it)" in told.lines[0]
    assert "below" not in told.lines[0]
    off = with_mode("accurate", zones=Zones(0.0, -0.01, -0.12))
    faint = judge(replace(off, share=Zones(0.5, 0.4995, 0.0005)))
    assert "above" not in faint.lines[0]


@pytest.mark.parametrize(
    ("changes", "look"),
    [
        ({"detail": 0.8, "detail_noise": 0.0}, "crisp"),
        ({"detail": 0.85, "detail_noise": 0.06}, "soft"),  # not surely
        ({"detail": 1.2, "detail_noise": 0.5}, "soft"),
        ({"detail": 0.79}, "soft"),
        ({"haze": 0.3}, "soft"),
        ({"error": 0.2}, "soft"),
        ({"detail": 0.49}, "hazy"),
        ({"haze": 0.5}, "hazy"),
    ],
)
def test_the_look_is_judged_by_detail_haze_and_error(changes: dict[str, float], look: str) -> None:
    told = judge(with_look(**changes))
    assert told.look == look
    assert told.lines[1].startswith(f"look: {look},")


def test_a_lamp_that_was_not_seen_has_no_look() -> None:
    told = judge(replace(FINE, look=None))
    assert told.look == ""
    assert not any("look" in line for line in told.lines)
    assert told.caption == "light ±3 %, fast mode ok"


@pytest.mark.parametrize(
    ("verdict", "why"),
    [
        (with_mode("fast", within=0.15), "makes its light blotchy; within ±15 %"),
        (with_mode("fast", pattern=0.3), "loses its patterns (keeps 30 % of their contrast)"),
        (with_mode("fast", pattern=-0.1), "(keeps 0 % of their contrast)"),
        (with_mode("fast", within=0.2, pattern=0.1), "contrast) and makes its light blotchy"),
    ],
)
def test_why_fast_mode_is_not_recommended(verdict: Verdict, why: str) -> None:
    told = judge(verdict)
    assert told.fast is False
    assert told.on_fast.startswith("fast mode: not recommended, it ")
    assert why in told.on_fast
    assert told.on_fast in told.lines


def test_fast_mode_may_lose_patterns_that_nobody_sees() -> None:
    assert judge(replace(with_mode("fast", pattern=0.0), pattern=0.02)).fast


def test_fast_mode_may_be_as_far_off_as_accurate_mode() -> None:
    poor = with_mode("accurate", within=0.2)
    assert judge(replace(poor, fast=with_mode("fast", within=0.23).fast)).fast


def test_a_lamp_without_fast_mode_is_not_advised_on_it() -> None:
    told = judge(replace(FINE, fast=None))
    assert (told.fast, told.on_fast) == (None, "")


@pytest.mark.parametrize(
    ("verdict", "provenance", "advice"),
    [
        (with_look(detail=0.6), {"anchor": "none"}, "--anchor auto"),
        (with_look(detail=0.6), {"preset": "sketch"}, "(--preset draft)"),
        (with_look(detail=0.6), {"preset": "standard"}, "(--preset paper)"),
        (with_look(detail=0.6), {"preset": "paper"}, "a longer training"),
        (replace(FINE, by_heart=0.2), {}, "more photons"),
        (replace(FINE, grain=40.0), {}, "many samples per pixel"),
        (replace(FINE, near=Places(0.3, 0.05, 0.1)), {}, "no walls or tables"),
    ],
)
def test_what_would_help(verdict: Verdict, provenance: dict[str, str], advice: str) -> None:
    assert judge(verdict, provenance).lines[-1].startswith("would help: ")
    assert advice in judge(verdict, provenance).lines[-1]


def test_an_anchor_that_was_tried_is_not_advised() -> None:
    tried = {"anchor": "none", "tried_anchors": ["none", "straight"]}
    assert "--anchor" not in judge(with_look(detail=0.6), tried).lines[-1]
    assert "--anchor" in judge(with_look(detail=0.6), tried | {"tried_anchors": []}).lines[-1]


def test_provenance_may_be_anything() -> None:
    soft = with_look(detail=0.6)
    for odd in ({}, {"preset": ["draft"], "anchor": None}, {"preset": {"draft": 1}}):
        assert "a longer training" in judge(soft, odd).lines[-1]


def test_thresholds_are_in_order() -> None:
    assert 0 < words.GOOD < words.FAIR
    assert 0 < words.RESOLVED < words.KEPT < 1
    assert 0 < words.CLEAR < words.FOGGY


# In a file


def written(tmp_path: Path, fidelity: Any) -> Path:
    manifest, content = lamp.parts()
    path = tmp_path / "lamp.plux"
    bundle.write(path, replace(manifest, fidelity=fidelity), content)
    return path


def test_inspect_says_whose_words_they_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    soft = with_look(detail=0.6)
    fidelity = {"verdict": soft.to_json(), "held_out_gain_nats": 1.6}
    assert cli.inspect_main([str(written(tmp_path, fidelity))]) == 0
    out = capsys.readouterr().out
    lines = out.splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("verdict"))
    assert lines[first].split(maxsplit=1)[1] == "says its maker:"
    assert lines[first + 1].split()[:4] == ["light", "in", "the", "room"]
    for line in judge(soft, lamp.parts()[0].provenance).lines:
        assert line in " ".join(out.split()), line
    assert "verdict.accurate" not in out
    assert "5 times likelier" in " ".join(out.split()) or "4.95 times likelier" in out
    assert max(map(len, lines)) <= 120


def test_inspect_speaks_json_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.inspect_main([str(written(tmp_path, {"verdict": FINE.to_json()})), "--json"]) == 0
    fidelity = json.loads(capsys.readouterr().out)["manifest"]["fidelity"]
    assert read(fidelity["verdict"]) == FINE


@pytest.mark.parametrize("odd", ["good", 3, None, {"accurate": {"within": "little"}}, {}])
def test_a_verdict_of_another_form_spoils_nothing(
    odd: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, {"verdict": odd})
    assert cli.inspect_main([str(path)]) == 0
    assert "says its maker" not in capsys.readouterr().out
    found = validate(path)
    assert found.valid
    codes = [i.code.name for i in found.issues if i.code.severity is Severity.WARNING]
    assert codes == ([] if odd is None else ["PLX_MANIFEST_VERDICT"])


def test_the_schema_says_the_same() -> None:
    from jsonschema import Draft202012Validator

    schema = json.loads((Path(__file__).parents[3] / "spec/schema/verdict.schema.json").read_text())
    check = Draft202012Validator(schema)
    assert check.is_valid(FINE.to_json())
    assert check.is_valid(replace(FINE, fast=None, near=None, look=None, grain=None).to_json())
    for field in ("accurate", "share", "photons"):
        assert not check.is_valid({k: v for k, v in FINE.to_json().items() if k != field})
    assert not check.is_valid(FINE.to_json() | {"look": {"detail": 1}})
    assert not check.is_valid(with_mode("fast", within=-0.1).to_json())


# On a picture


def test_a_caption_is_a_bar_below_the_picture() -> None:
    import io

    import numpy as np
    from PIL import Image

    from purelight_format.srgb import plain_png

    before = np.random.default_rng(0).random((256, 256, 3))
    after = np.asarray(Image.open(io.BytesIO(caption.under(plain_png(before), "light ±3 %"))))
    assert after.shape[0] > 256
    assert after.shape[1:] == (256, 3)
    plain = np.asarray(Image.open(io.BytesIO(plain_png(before))))
    np.testing.assert_array_equal(after[:256], plain)
    assert after[256:].max() > 150  # ink
    assert np.median(after[256:]) < 40
