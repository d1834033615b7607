"""Mitsuba's variants, changed back and forth in one process: lamps shine in each of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import analytic_lamps as lamps

# Mitsuba ships two RGB variants, and one of them needs a GPU. `pretend` registers the plugins as if
# the other one's types were those of a variant with another name.
START = """
import importlib, pkgutil, sys
import purelight_mitsuba
from purelight_mitsuba import register
import mitsuba as mi
import numpy as np

def pretend(name):
    real = mi.variant
    mi.variant = lambda: name
    register()
    mi.variant = real

def render(scene):
    image = mi.render(scene, integrator=mi.load_dict({"type": "purelight"}), spp=4, seed=1)
    return np.array(image)

def room():
    return mi.load_dict({
        "type": "scene",
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8},
                   "to_world": mi.ScalarTransform4f().look_at([2, 0, 1], [0, 0, 0], [0, 0, 1])},
        "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(3)},
        "lamp": {"type": "purelight", "filename": sys.argv[1]},
    })

def everything():
    names = [m.name for m in pkgutil.walk_packages(purelight_mitsuba.__path__, "purelight_mitsuba.")
             if not m.name.endswith("conformance_host")]  # That one chooses a variant itself.
    return {name: importlib.import_module(name) for name in names}
"""


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return lamps.ball().write(tmp_path_factory.mktemp("lamp") / "ball.plux")


def run(script: str, bundle: Path) -> None:
    """Runs a script, which asserts, in a process of its own."""
    command = [sys.executable, "-c", START + script, str(bundle)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr


def test_a_lamp_shines_in_a_second_rgb_variant(bundle: Path) -> None:
    run(
        """
mi.set_variant("llvm_ad_rgb")
first = render(room())
assert first.mean() > 0.1
for name in ("llvm_other_ad_rgb", "llvm_ad_rgb", "llvm_other_ad_rgb"):
    pretend(name)
    np.testing.assert_allclose(render(room()), first, rtol=1e-5)
""",
        bundle,
    )


def test_every_module_follows_whatever_variant_first_imported_it(bundle: Path) -> None:
    run(
        """
mi.set_variant("llvm_ad_spectral")
everything()
mi.set_variant("llvm_ad_rgb")
scene = room()
assert render(scene).mean() > 0.1
from purelight_mitsuba.output import first_hit, passes
assert first_hit.layers(scene)["albedo"].max() > 0.99  # The lamp counts as white.
assert isinstance(passes.integrator_for(scene), mi.SamplingIntegrator)
""",
        bundle,
    )


def test_coming_back_restores_the_very_same_modules(bundle: Path) -> None:
    run(
        """
mi.set_variant("llvm_ad_rgb")
from purelight_mitsuba.transport.integrator import PureLightIntegrator
from purelight_mitsuba.lamps.emitter import PureLightEmitter
scene, before = room(), everything()
image = render(scene)
for name in ("scalar_rgb", "llvm_ad_rgb", "llvm_ad_mono", "llvm_ad_spectral", "llvm_ad_rgb"):
    mi.set_variant(name)
    everything()
assert everything() == before
from purelight_mitsuba.lamps import emitter
from purelight_mitsuba.transport import integrator
assert integrator.PureLightIntegrator is PureLightIntegrator
assert isinstance(mi.load_dict({"type": "purelight"}), PureLightIntegrator)
assert isinstance(scene.emitters()[0], PureLightEmitter)
assert isinstance(room().emitters()[0], emitter.PureLightEmitter)
np.testing.assert_allclose(render(scene), image, rtol=1e-5)
""",
        bundle,
    )


def test_a_module_may_choose_a_variant_while_it_is_imported(bundle: Path) -> None:
    run(
        """
mi.set_variant("llvm_ad_mono")
everything()
from purelight_mitsuba import conformance_host
assert mi.variant() == "llvm_ad_rgb"
from purelight_mitsuba.lamps.table import Lamps
assert conformance_host.Lamps is Lamps
host = conformance_host.MitsubaHost()
host.open(sys.argv[1])
ray = {"origin": np.array([[3.0, -0.2, 0.1]]), "direction": np.array([[-1.0, 0.0, 0.0]])}
assert host.evaluate("view", {}, ray)["radiance"].max() > 0.1
""",
        bundle,
    )
