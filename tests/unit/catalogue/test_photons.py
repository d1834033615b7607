"""Light traced in parts: the sums are those of all at once."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from purelight_catalogue import photons
from purelight_catalogue.entries import Entry
from purelight_catalogue.jobs import PART, Settings, jobs_of
from purelight_catalogue.streams import Streams, joined
from purelight_format.color import lumens
from purelight_format.errors import PureLightError
from purelight_train.runs.run_directory import RunDirectory
from tests.support import tiny, untrained

ISSUED = ("--issued", "2026-01-31")


def batches(count: int) -> list[dict[str, np.ndarray]]:
    rng = np.random.default_rng(5)
    return [{"flux": rng.normal(3, 1, 3), "far_field": rng.random((2, 4, 3))} for _ in range(count)]


def test_parts_join_to_the_whole_in_any_order(tmp_path: Path) -> None:
    whole, parts, files = Streams(), [Streams() for _ in range(3)], []
    for number, arrays in enumerate(batches(12)):
        whole.add(10, arrays)
        parts[number % 3].add(10, arrays)
    for number, part in enumerate(parts):
        files.append(tmp_path / f"{number}.npz")
        part.write(files[-1])
    again = joined(reversed(files))
    assert (again.batches, again.paths) == (12, 120)
    for name in ("flux", "far_field"):
        np.testing.assert_allclose(again.mean(name), whole.mean(name), rtol=1e-12)
        np.testing.assert_allclose(again.error(name), whole.error(name), rtol=1e-9)


def test_the_error_is_the_spread_of_the_batches() -> None:
    streams = Streams()
    values = np.random.default_rng(1).normal(7, 2, (400, 3))
    for value in values:
        streams.add(1, {"flux": value})
    expected = values.std(0, ddof=1) / math.sqrt(len(values))
    np.testing.assert_allclose(streams.error("flux"), expected, rtol=1e-9)


def test_one_batch_knows_no_error() -> None:
    streams = Streams()
    streams.add(1, {"flux": np.ones(3)})
    assert np.isinf(streams.error("flux")).all()


def test_a_part_that_is_no_part_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "part.npz").write_bytes(b"PK")
    with pytest.raises(PureLightError, match="unreadable"):
        Streams.read(tmp_path / "part.npz")


def test_a_lamps_photons_are_parted_by_seed(tmp_path: Path) -> None:
    entry = Entry("lamp", tiny.write(tmp_path))
    jobs = jobs_of(entry, Settings(photons=2 * PART + 1))
    parts, (join,) = (
        [job for job in jobs if job.stage == kind] for kind in ("photons", "photometry")
    )
    assert [part.arguments["seed"] for part in parts] == [1, 2, 3]
    assert list(join.before.values()) == [jobs[0].key, *(part.key for part in parts)]
    more = jobs_of(entry, Settings(photons=4 * PART))
    assert {part.key for part in parts} <= {job.key for job in more}  # What is traced stays


def test_a_lamp_is_traced_and_joined(tmp_path: Path) -> None:
    lamp, files = tiny.write(tmp_path), []
    for seed in (1, 2):
        files.append(tmp_path / f"{seed}.npz")
        words = ["trace", str(lamp), "--paths", "1", "--seed", str(seed), "--output"]
        assert photons.main([*words, str(files[-1])]) == 0
    words = ["join", *map(str, files), "--name", "lamp", *ISSUED, "--output", str(tmp_path / "out")]
    assert photons.main(words) == 0
    figures = json.loads((tmp_path / "out/lamp.photons.json").read_text())
    first, second = (Streams.read(file).mean("flux") for file in files)
    assert (first != second).any()
    np.testing.assert_allclose(figures["flux"], (first + second) / 2)
    assert 0 < figures["lumens_error"] < 0.02 * figures["lumens"]
    from photompy import IESFile

    told = IESFile.read(tmp_path / "out/lamp.photons.ies").photometry.total_optical_power()
    assert float(told) == pytest.approx(figures["lumens"], rel=5e-3)
    assert (tmp_path / "out/truth.png").is_file()


def test_the_scene_that_was_trained_is_traced_wherever_its_run_lies(tmp_path: Path) -> None:
    """Of a lamp of another format, that is its import; its own file cannot be traced."""
    (tmp_path / "run").mkdir()
    run = RunDirectory(untrained.write(tmp_path / "run"))
    glb, draft = tmp_path / "lamp.glb", "/elsewhere/.train-0123.host.7.draft/run/lamp/lamp.xml"
    glb.write_bytes(b"glTF")
    run.write_json("config.json", run.config | {"luminaire": draft})
    (run.path / "lamp").mkdir()
    made = tiny.write(run.path / "lamp")
    part = tmp_path / "part.npz"
    words = ["trace", str(glb), "--run", str(run.path), "--paths", "1", "--seed", "1"]
    assert photons.main([*words, "--output", str(part)]) == 0
    np.testing.assert_array_equal(
        Streams.read(part).mean("flux"), photons.traced(made, 1, 1).mean("flux")
    )
    run.write_json("config.json", run.config | {"luminaire": "/elsewhere/lamp.xml"})
    assert photons.scene_of(run.path, glb) == glb


def test_traced_light_is_scaled_as_the_bundle_is(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    run = RunDirectory(untrained.write(tmp_path / "run"))
    trained = lumens(run.description.flux)
    streams, part = Streams(), tmp_path / "part.npz"
    for arrays in batches(4):
        picture = np.ones((4, 4, 3)) * arrays["flux"]
        streams.add(10, arrays | {"far_field": np.ones((2, 3, 3)), "picture": picture})
    streams.write(part)
    found = []
    for more in ([], ["--lumens", str(2 * trained), "--run", str(run.path)]):
        words = ["join", str(part), "--name", "lamp", *ISSUED, "--output", str(tmp_path / "out")]
        assert photons.main([*words, *more]) == 0
        found.append(json.loads((tmp_path / "out/lamp.photons.json").read_text()))
    for key in ("flux", "flux_error", "lumens", "lumens_error"):
        np.testing.assert_allclose(found[1][key], 2 * np.array(found[0][key]))
    assert found[1]["picture_noise"] == pytest.approx(found[0]["picture_noise"])
