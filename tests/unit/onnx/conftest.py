"""The glowing ball, as a bundle and as a luminaire."""

from __future__ import annotations

import pytest

from purelight_onnx.luminaire import Luminaire
from tests.support import glowing_ball
from tests.support.glowing_ball import FakeBundle


@pytest.fixture
def bundle() -> FakeBundle:
    return glowing_ball.bundle()


@pytest.fixture
def luminaire(bundle: FakeBundle) -> Luminaire:
    return Luminaire(bundle, check_vectors=False)  # type: ignore[arg-type]
