"""Far-field intensity: a known lamp's, and the exporter's table of the same light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from purelight_train.light.exit_records import ExitRecords
from purelight_train.truth.far_field import IntensityZones, interpolate

POWER = np.array([3.0, 2.0, 1.0])


def lobe(count: int = 1 << 18) -> ExitRecords:
    """Intensity in proportion to 1 + x / 2 - z / 4, drawn by rejection."""
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(3 * count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    shape = 1 + direction[:, 0] / 2 - direction[:, 2] / 4
    direction = direction[rng.random(len(shape)) < shape / 1.75][:count].astype(np.float32)
    zero = np.zeros_like(direction)
    weight = np.broadcast_to(POWER.astype(np.float32), direction.shape).copy()
    free = np.full(count, np.inf, np.float32)
    bare = np.zeros(count, bool)
    return ExitRecords(zero, zero, zero, direction, weight, free, bare, count)


def expected(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    shape = 1 + direction[..., 0] / 2 - direction[..., 2] / 4
    return shape[..., None] * POWER / (4 * np.pi)


def test_zones_hold_the_intensity() -> None:
    field = IntensityZones.of(lobe())
    true = expected(field.directions()).mean(2)
    z = (field.intensity - true)[..., 0] / field.error[..., 0]
    assert 0.85 < np.sqrt(np.mean(z**2)) < 1.15
    assert np.abs(z).max() < 4.5
    np.testing.assert_allclose(field.intensity.mean((0, 1)) * 4 * np.pi, POWER, rtol=1e-6)


def test_exported_table_agrees() -> None:
    from purelight_export.photometry import intensity

    records = lobe()
    table = intensity(records.direction, records.weight, tuple(POWER))
    direction = IntensityZones.of(records).directions()
    told = interpolate(table.vertical, table.horizontal, table.values, direction)
    error = np.abs(told - expected(direction)).mean() / expected(direction).mean()
    assert error < 0.03
