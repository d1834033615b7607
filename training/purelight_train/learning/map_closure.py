"""The light that a fast map sends to all sides of its lamp, made the traced light."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray

from purelight_format.measures import cap, cap_to_direction
from purelight_train.learning.flux_closure import effective_size, moments_of, tilt
from purelight_train.light.direction_zones import fibonacci_lattice
from purelight_train.light.exit_records import ExitRecords
from purelight_train.networks.fast_map import MOST_GAIN, SIZE, FastMap

PLACES = 1 << 15
BATCH = 1 << 10
ROUNDS = 8
Cells = NDArray[np.float64]


@torch.no_grad()
def close_light(
    network: FastMap, records: ExitRecords, progress: Callable[[int], None] = lambda _: None
) -> None:
    r"""Give the light of a map the flux and the harmonics of traced light, near and far.

    Whatever leaves a lamp crosses every sphere around it. How much crosses where, the map says in
    the irradiance from inside, and each traced photon by its place. On the sphere of each knot of
    the gain the most likely tilt (`flux_closure.tilt`) makes both alike. A map learns from
    estimates of which few are bright, so that where those were missed it is too dim as a whole.

    Arguments:
        network: trained, with a tilt of zero.
        records: traced light, of which that which escapes counts.
        progress: called with the knots done so far.
    """
    toward = fibonacci_lattice(PLACES)
    escaped = records.take(records.escaped)
    weight = escaped.weight.astype(np.float64) / records.paths
    number, features = effective_size(weight), _harmonics(network, toward)
    found = np.zeros(network.tilt.shape)
    for knot, distance in enumerate(network.knot_distances()):
        told = told_light(network, distance, toward)
        moments = moments_of(_crossing(network, escaped, distance), weight)
        for c in np.flatnonzero(told.sum(0) * weight.sum(0)):
            more = tilt(told[:, c], features, moments[c], float(number[c]))
            log_gain = _closed(told[:, c], features @ more, float(weight[:, c].sum()))
            found[knot, c] = more
            found[knot, c, 0] += log_gain / features[0, 0]  # Of which the first is constant
        progress(knot + 1)
    network.tilt.copy_(torch.from_numpy(found))


def _crossing(network: FastMap, light: ExitRecords, distance: float) -> Callable[[slice], Cells]:
    """The harmonics of where some of the light crosses a sphere of so many radii: [K, H]."""
    sphere = network.encoding.sphere
    return lambda part: _harmonics(network, light.take(part).crossings(sphere, distance))


def _closed(told: Cells, log_tilt: Cells, flux: float) -> float:
    """What to add to the logarithm of a gain, within its bounds, so that light [K] has a flux."""
    log_gain = 0.0
    for _ in range(ROUNDS):
        gain = np.exp(np.clip(log_gain + log_tilt, -MOST_GAIN, MOST_GAIN))
        log_gain += float(np.log(flux / (told * gain).sum()))
    return log_gain


def _harmonics(network: FastMap, toward: NDArray[np.floating]) -> Cells:
    """Of the direction from places to the lamp, where these are the directions from it: [K, H]."""
    back = torch.from_numpy(-toward).to(network.tilt)
    found: Cells = network.harmonics(back).cpu().double().numpy()
    return found


@torch.no_grad()
def told_light(network: FastMap, distance: float, toward: NDArray[np.float64]) -> Cells:
    """What a map says of the power through a sphere of so many radii: [K, 3] in W.

    All places on it are equally far from the centre, so a cell is seen at the same angle from each.

    Arguments:
        toward: [K, 3], even directions (`fibonacci_lattice`), each for its part of the sphere.
    """
    sphere = network.encoding.sphere
    place = np.asarray(sphere.center) + distance * sphere.radius * toward
    view = cap(place[:1].repeat(SIZE**2, 0), sphere)
    row, column = np.divmod(np.arange(SIZE**2), SIZE)
    seen = cap_to_direction((np.stack((column, row), 1) + 0.5) / SIZE, view)
    projected = (seen * view.axis).sum(1) * view.solid_angle / SIZE**2
    cells = torch.from_numpy(projected.reshape(SIZE, SIZE, 1)).to(network.tilt)
    point = torch.from_numpy(place).to(network.tilt)
    irradiance = torch.cat([(network(part) * cells).sum((1, 2)) for part in point.split(BATCH)])
    area = 4 * np.pi * (distance * sphere.radius) ** 2 / len(toward)
    return irradiance.cpu().double().numpy() * area
