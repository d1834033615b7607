"""The engines agree, nothing is lost in the queue, and memory does not grow with samples."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from purelight_export.graph import Graph
from purelight_format.errors import PureLightError
from purelight_mitsuba.lamps.luminaire import load
from purelight_mitsuba.transport import (
    answers,
    batched_maps,
    fused,
    integrator,
    queries,
    queue,
    queued,
    scene_parts,
)
from purelight_mitsuba.transport.film_passes import sample_counts
from purelight_onnx.luminaire import Luminaire
from tests.support import analytic_lamps as lamps
from tests.support.agreement import agree, passes
from tests.support.long_rendering import peak_megabytes

ENGINES = ("fused", "queued")
MODES = ("accurate", "fast")
T = mi.ScalarTransform4f
TO_WORLD = T().translate([0.1, 0.2, 0.3])


def layered() -> bytes:
    """An appearance network of three layers, smooth and of some contrast."""
    graph, rng = Graph("appearance"), np.random.default_rng(0)
    x = graph.concat([graph.input(name, 3) for name in ("position", "normal", "outgoing")])
    for width in (32, 32):
        weight = rng.normal(size=(width, x.shape[0])).astype(np.float32) / 3
        x = graph.relu(graph.linear(x, weight, rng.normal(size=width).astype(np.float32)))
    weight = rng.normal(size=(3, 32)).astype(np.float32) / 5
    graph.output("radiance", graph.exp(graph.linear(x, weight, np.ones(3, np.float32))))
    return graph.to_bytes()


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    lamp = lamps.ball()
    lamp.networks.update(appearance=layered(), fast_map=lamps.shining_map())
    return lamp.write(tmp_path_factory.mktemp("lamps") / "layered.plux")


@pytest.fixture(scope="module")
def scene(bundle: Path) -> mi.Scene:
    light = {
        "type": "rectangle",
        "to_world": lamps.look_at((0.5, -1.2, 1.2), (0, 0, -0.5)) @ T().scale(0.2),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [1.0, 2.0, 4.0]}},
    }
    lamp = {"type": "purelight", "filename": str(bundle), "to_world": TO_WORLD}
    small = lamp | {"to_world": T().translate([-0.6, 0.6, 0.3]).scale(0.5)}
    return mi.load_dict(lamps.room() | {"light": light, "a": lamp, "b": small})


def ours(engine: str = "queued", mode: str = "accurate", **settings: Any) -> dict[str, Any]:
    return {"type": "purelight", "engine": engine, "mode": mode, "max_depth": 4, **settings}


def render(scene: mi.Scene, spp: int = 16, **settings: Any) -> np.ndarray:
    return np.array(mi.render(scene, integrator=mi.load_dict(ours(**settings)), spp=spp, seed=1))


@pytest.mark.parametrize("mode", MODES)
def test_engines_agree(scene: mi.Scene, mode: str) -> None:
    pictures = [passes(scene, ours(engine, mode), 32, first=k) for k, engine in enumerate(ENGINES)]
    agree(*pictures)


def test_without_roulette_of_shadow_rays_the_mean_is_the_same(
    scene: mi.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = passes(scene, ours(), 32)
    monkeypatch.setattr(queued, "ROULETTE", 1e9)
    agree(few, passes(scene, ours(), 32, first=100))


@pytest.mark.parametrize("capacity", [300, 3000])
@pytest.mark.parametrize("mode", MODES)
def test_a_queue_that_is_too_small_loses_nothing(
    scene: mi.Scene, mode: str, capacity: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    spp = 8 if capacity > 1000 else 1
    whole = render(scene, spp, mode=mode)
    emptied = count_calls(monkeypatch, queue.Queue, "take")
    monkeypatch.setattr(queue, "CAPACITY", capacity)
    np.testing.assert_allclose(render(scene, spp, mode=mode), whole, rtol=1e-4, atol=1e-5)
    assert len(emptied) > 2


def kernels(scene: mi.Scene, spp: int, mode: str) -> list[dict[str, Any]]:
    """Those of a rendering that are slow to compile."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        render(scene, spp, mode=mode)
        history = dr.kernel_history([dr.KernelType.JIT])
    return [kernel for kernel in history if kernel["operation_count"] > 500]


@pytest.mark.parametrize("mode", MODES)
def test_rounds_of_a_queue_have_one_kernel(
    scene: mi.Scene, mode: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With one of its own for the first round, a picture takes twice as long to compile."""
    monkeypatch.setattr(queue, "CAPACITY", 3000)
    lanes = 8 * int(np.prod(scene.sensors()[0].film().crop_size()))
    traced = [kernel["hash"] for kernel in kernels(scene, 8, mode) if kernel["size"] == lanes]
    assert len(traced) > 2
    assert len(set(traced)) == 1


@pytest.mark.parametrize("mode", MODES)
def test_another_number_of_samples_compiles_no_network_anew(scene: mi.Scene, mode: str) -> None:
    few, many = ({k["hash"] for k in kernels(scene, spp, mode)} for spp in (4, 8))
    assert few
    assert many <= few


def test_answers_in_batches_are_those_of_the_kernel(
    scene: mi.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = render(scene)
    batched = count_calls(monkeypatch, answers, "_batched")
    monkeypatch.setattr(answers, "LARGEST_COMPILED", -1)
    np.testing.assert_allclose(render(scene), compiled, rtol=1e-4, atol=1e-5)
    assert batched


def test_maps_in_batches_are_those_of_the_kernel(
    scene: mi.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A batch is smaller than the queue, and the networks are not translated without need."""
    compiled = render(scene, mode="fast")
    batched = count_calls(monkeypatch, queries, "draw_batched")
    monkeypatch.setattr(batched_maps, "LARGEST_COMPILED", -1)
    monkeypatch.setattr(batched_maps, "ROWS", 3000)
    np.testing.assert_allclose(render(scene, mode="fast"), compiled, rtol=1e-3, atol=1e-4)
    assert batched


def test_values_of_both_engines_are_those_of_onnx_runtime(bundle: Path) -> None:
    rng, luminaire = np.random.default_rng(5), load(bundle)
    away = rng.normal(size=(3, 4096))
    away = (away / np.linalg.norm(away, axis=0)).astype(np.float32)
    position = (np.array(lamps.CENTRE)[:, None] + lamps.RADIUS * away).astype(np.float32)
    expected = Luminaire.open(bundle).radiance(position.T, away.T, away.T)
    scale = expected.mean()
    for evaluate in (answers._compiled, answers._batched):
        ray = queries.ExitRay(mi.Point3f(position), mi.Normal3f(away), mi.Vector3f(away))
        found = np.array(evaluate(luminaire, ray)).T
        assert np.abs(np.log1p(found / scale) - np.log1p(expected / scale)).max() < 1e-4


def count_calls(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> list[int]:
    calls: list[int] = []
    function: Callable[..., Any] = getattr(owner, name)

    def counted(*arguments: Any) -> Any:
        calls.append(1)
        return function(*arguments)

    monkeypatch.setattr(owner, name, counted)
    return calls


def test_passes_leave_one_film(scene: mi.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    sensor = scene.sensors()[0]
    usual = sensor.sampler().sample_count()
    monkeypatch.setattr(queued.Queued, "lanes", 3 * 32 * 32)
    picture = mi.render(scene, integrator=mi.load_dict(ours()), spp=0, seed=2)
    assert sensor.sampler().sample_count() == usual
    developed = sensor.film().develop()
    np.testing.assert_array_equal(np.array(developed), np.array(picture))
    split = passes(scene, ours(), 8, 8)
    monkeypatch.undo()
    agree(split, passes(scene, ours(), 8, 8, first=50), 0.02)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("mode", MODES)
def test_spoilt_answers_are_dark_and_counted(tmp_path: Path, mode: str, engine: str) -> None:
    path = lamps.ball(spoilt=True).write(tmp_path / "spoilt.plux")
    lamp = {"type": "purelight", "filename": str(path), "to_world": TO_WORLD}
    made = mi.load_dict(ours(engine, mode))
    with pytest.warns(UserWarning, match="infinite or no number"):
        image = np.array(mi.render(mi.load_dict(lamps.room() | {"l": lamp}), integrator=made))
    assert np.isfinite(image).all()
    assert made.spoilt > 0


def test_spoilt_answers_are_counted_in_shadow_rays(tmp_path: Path) -> None:
    """The camera sees no lamp, so only the queue can find them."""
    path = lamps.ball(spoilt=True).write(tmp_path / "spoilt.plux")
    lamp = {"type": "purelight", "filename": str(path), "to_world": TO_WORLD}
    room = mi.load_dict(lamps.room() | {"l": lamp})
    counts = []
    for engine in ENGINES:
        made = mi.load_dict(ours(engine, max_depth=2, hide_emitters=True))
        with pytest.warns(UserWarning, match="infinite or no number"):
            mi.render(room, integrator=made, spp=16)
        counts.append(made.spoilt)
    assert counts[1] == pytest.approx(counts[0], rel=0.1)


def test_auto_queues_what_costs_more(scene: mi.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    def chosen(integrator: Any) -> type:
        return type(integrator.prepare(scene).engine)

    made = mi.load_dict(ours("auto"))
    assert chosen(made) is fused.Fused
    monkeypatch.setattr(scene_parts, "LEAST_QUEUED", 1000)
    assert chosen(mi.load_dict(ours("auto"))) is queued.Queued
    made.engine = "queued"
    assert chosen(made) is queued.Queued


def test_unknown_engine() -> None:
    properties = mi.Properties("purelight")
    properties["engine"] = "steam"
    with pytest.raises(PureLightError, match="engine steam is none of"):
        integrator.PureLightIntegrator(properties)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_many_samples_and_many_lamps_run_to_the_end(bundle: Path, engine: str) -> None:
    """In a process of its own: the most that this one had may be another test's."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as alone:
        assert alone.submit(peak_megabytes, bundle, engine).result() < 4096


def test_passes_have_multiples_of_what_is_asked_for() -> None:
    assert sample_counts(20, 7, 5) == [5, 5, 5, 5]
    assert sample_counts(20, 12, 5) == [10, 10]
    assert sample_counts(20, 3, 5) == [5, 5, 5, 5]
    assert sample_counts(21, 7, 5) == [7, 7, 7]
    assert sample_counts(20, 7) == [7, 7, 6]


def test_within_another_integrator_memory_is_that_of_the_fused_engine(tmp_path: Path) -> None:
    """Nobody there splits a picture into passes that the queue can hold."""
    scene = mi.load_dict(lamps.room() | {
        "lamp": {"type": "purelight", "filename": str(lamps.ball().write(tmp_path / "a.plux"))},
    })  # fmt: skip
    inner = mi.load_dict({"type": "purelight", "max_depth": 2})
    used = []
    prepare = inner._prepare
    inner._prepare = lambda scene, engine: used.append(engine) or prepare(scene, engine)
    mi.render(scene, integrator=mi.load_dict({"type": "aov", "aovs": "d:depth", "a": inner}), spp=2)
    assert used[-1] == "fused"
    used.clear()
    mi.render(scene, integrator=inner, spp=2)
    assert set(used) == {"auto"}


@pytest.mark.parametrize("depth", [1, 3])
@pytest.mark.parametrize("sky", [False, True])
@pytest.mark.parametrize("hide", [False, True])
def test_alpha_is_that_of_the_path_tracer(depth: int, sky: bool, hide: bool) -> None:
    content = lamps.room(size=16)
    content["sensor"] = content["sensor"] | {
        "film": content["sensor"]["film"] | {"pixel_format": "rgba"},
        "to_world": lamps.look_at((2.2, 1.2, 1.4), (0, 0.1, 0.1)),
    }
    if sky:
        content["sky"] = {"type": "constant", "radiance": 0.3}
    scene = mi.load_dict(content)
    ours, theirs = (
        np.array(mi.render(scene, integrator=mi.load_dict(
            {"type": kind, "max_depth": depth, "hide_emitters": hide}), spp=16, seed=1))[..., 3]
        for kind in ("purelight", "path")
    )  # fmt: skip
    np.testing.assert_allclose(ours, theirs, atol=0.1)
    assert ours.mean() == pytest.approx(theirs.mean(), abs=0.01)


@pytest.mark.parametrize("engine", ["fused", "queued"])
def test_a_frozen_function_is_refused(engine: str, tmp_path: Path) -> None:
    """Dr.Jit would end the process."""
    scene = mi.load_dict(lamps.room() | {
        "lamp": {"type": "purelight", "filename": str(lamps.ball().write(tmp_path / "a.plux"))},
    })  # fmt: skip
    integrator = mi.load_dict({"type": "purelight", "engine": engine, "max_depth": 2})

    @dr.freeze
    def drawn(seed: mi.UInt32) -> mi.TensorXf:
        return mi.render(scene, integrator=integrator, spp=2, seed=seed)

    with pytest.raises(Exception) as caught:
        drawn(mi.UInt32(1))
    causes, cause = [], caught.value
    while cause is not None:
        causes.append(str(cause))
        cause = cause.__cause__ or cause.__context__
    assert "dr.freeze" in causes[-1]
