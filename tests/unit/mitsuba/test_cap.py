"""The cap and its frame against the NumPy reference."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from purelight_format import measures
from purelight_mitsuba.sampling.cap import cap, frame

CENTRE, RADIUS = (0.3, -0.2, 0.1), 0.25
SPHERE = measures.BoundingSphere(CENTRE, RADIUS)


def points() -> np.ndarray:
    """Points at every distance, on the poles, on the sphere, inside, and at the centre."""
    rng = np.random.default_rng(0)
    away = rng.normal(size=(200, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    away[:4] = [[0, 0, 1], [0, 0, -1], [1e-12, 0, 1], [1, 0, 0]]
    distance = RADIUS * np.repeat([0.0, 0.5, 1.0001, 1.5, 15, 1e3, 1e6, 4], 25)
    rng.shuffle(distance)
    return np.asarray(CENTRE + away * distance[:, None], np.float32)


def test_cap_equals_the_reference() -> None:
    reference = measures.cap(points().astype(np.float64), SPHERE)
    ours = cap(mi.Point3f(points().T), mi.Point3f(*CENTRE), mi.Float(RADIUS))
    outside = np.array(ours.outside)
    np.testing.assert_array_equal(outside, reference.outside)
    np.testing.assert_allclose(
        np.array(ours.one_minus_cos)[outside], reference.one_minus_cos[outside], rtol=3e-4
    )
    u = np.random.default_rng(1).random((200, 2)).astype(np.float32)
    toward = np.array(ours.direction(mi.Point2f(u.T))).T
    expected = measures.cap_to_direction(u.astype(np.float64), reference)
    smooth = outside & (reference.axis[:, 2] > -0.9999)  # The frame is singular at -Z.
    np.testing.assert_allclose(toward[smooth], expected[smooth], atol=2e-4)
    cosine, wanted = ((d * reference.axis).sum(1)[outside] for d in (toward, expected))
    np.testing.assert_allclose(cosine, wanted, atol=1e-5)
    assert np.isfinite(toward).all()
    density = np.array(ours.pdf_solid_angle())
    assert (density[~outside] == 0).all()
    np.testing.assert_allclose(density[outside] * reference.solid_angle[outside], 1, rtol=3e-4)


@pytest.mark.parametrize("z", [1.0, -1.0, 0.0, -0.0, -0.9999999])
def test_frame_equals_the_reference(z: float) -> None:
    x = np.sqrt(max(0.0, 1 - z * z))
    axis = np.array([[x, 0, z], [x * 0.6, -x * 0.8, z]], np.float32)
    tangent, bitangent, n = frame(mi.Vector3f(axis.T))
    for ours, reference in zip((tangent, bitangent), measures.frame(axis), strict=True):
        np.testing.assert_allclose(np.array(ours).T, reference, atol=1e-5)
    np.testing.assert_allclose(np.array(mi.Vector3f(n)).T, axis)
