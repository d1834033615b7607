"""Eqs. 1 to 13 of spec/measures.md: frames, disk maps, caps, and what is measured with them.

Eqs. 1 to 8 are for NumPy arrays, torch tensors and values of a graph alike (`namespace`), in the
type of their arguments. In a graph a coordinate [N] is [N, 1]. Bundles hold these operations in
this order: to change it changes every exported network.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Generic

import numpy as np

from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.namespace import A, namespace

QUARTER_PI = math.pi / 4
TINY = 1e-20  # Of x² + y²; a unit axis nearer to -Z has the frame of -Z.
FAR = 1e15  # Radii; farther points count as this far, so that squares stay finite in float32.
OUTSIDE = 1 + 1e-6  # Radii; a nearer point is served as if it were inside the sphere.
AHEAD = 1.5  # Bound on 1 - cos that tells the axis from its opposite, where x = y = 0 as well.
MAP_SIDE = 16  # Cells of the radiance map along a side.
STRAIGHT = 1e-8  # Of a transform's last row.
UNEVEN = 1e-4  # Relative; a scene file gives matrices with about six digits.


@dataclass(frozen=True)
class BoundingSphere:
    """A sphere around the exit surface, in the luminaire frame.

    Arguments:
        center: its centre in metres.
        radius: its radius in metres.
    """

    center: tuple[float, float, float]
    radius: float


@dataclass(frozen=True)
class Cap(Generic[A]):
    """The cap of directions in which a sphere is seen from each of N points.

    Arguments:
        axis: [N, 3] unit direction to the centre, +Z at the centre itself.
        one_minus_cos: [N] of the half-angle; 1 for points on or in the sphere.
        outside: [N] whether the point is outside the sphere.
    """

    axis: A
    one_minus_cos: A
    outside: A

    @property
    def solid_angle(self) -> A:
        """Solid angle of the cap, 2 pi (1 - cos): [N] in sr."""
        angle: A = self.one_minus_cos * (2 * math.pi)
        return angle


def frame(axis: A) -> tuple[A, A]:
    r"""Completes unit axes n to right-handed frames, :math:`t \times b = n` (Eq. 1).

    Arguments:
        axis: [N, 3] unit vectors; the only singular one is (0, 0, -1).

    Returns:
        tangent and bitangent, [N, 3] each.
    """
    xp = namespace(axis)
    x, y, z = xp.columns(axis)
    below = z < 0.0
    rho = x * x + y * y
    ahead = abs(z) + 1.0
    k = xp.where(below, ahead / xp.maximum(rho, TINY), 1.0 / ahead)
    pole = below & (rho < TINY)
    kx = xp.where(pole, 0.0, k * x)
    xy, yy = kx * y, xp.where(pole, 0.0, k * y * y)
    xx = xp.where(pole, 2.0, kx * x)
    return xp.concat([1.0 - xx, -xy, -x]), xp.concat([-xy, 1.0 - yy, -y])


def square_to_disk(u: A) -> A:
    """Equal-area concentric map of the unit square to the unit disk (Eq. 2).

    Shirley and Chiu, "A Low Distortion Map Between Disk and Square", 1997.

    Arguments:
        u: [N, 2] in [0, 1].

    Returns:
        [N, 2] points with x² + y² <= 1.
    """
    disk: A = namespace(u).concat(_disk(u))
    return disk


def _disk(u: Any) -> tuple[Any, Any]:
    xp = namespace(u)
    a, b = xp.columns(u * 2.0 - 1.0)
    horizontal = abs(a) > abs(b)
    r, minor = xp.where(horizontal, a, b), xp.where(horizontal, b, a)
    phi = QUARTER_PI * minor / _not_zero(r)
    along, across = r * xp.cos(phi), r * xp.sin(phi)
    return xp.where(horizontal, along, across), xp.where(horizontal, across, along)


def _not_zero(x: Any) -> Any:
    return namespace(x).where(~(abs(x) > 0.0), 1.0, x)


def disk_to_square(p: A) -> A:
    """Inverse of `square_to_disk` (Eq. 3): [N, 2] in the unit disk -> [N, 2] in [0, 1]."""
    square: A = _square(*namespace(p).columns(p))
    return square


def _square(x: Any, y: Any) -> Any:
    xp = namespace(x)
    horizontal = abs(x) > abs(y)
    major, minor = xp.where(horizontal, x, y), xp.where(horizontal, y, x)
    r = xp.sqrt(x * x + y * y) * xp.sign(major)
    t = r * xp.atan(minor / _not_zero(major)) * (1 / QUARTER_PI)
    a, b = xp.where(horizontal, r, t), xp.where(horizontal, t, r)
    return xp.clip(xp.concat([a, b]) * 0.5 + 0.5, 0.0, 1.0)


def cap(point: A, sphere: BoundingSphere) -> Cap[A]:
    r"""Returns the cap that a sphere covers, with :math:`1-\cos\theta = s^2/(1+\sqrt{1-s^2})`,
    :math:`s = \min(1, R/d)`: free of cancellation at any distance (Eq. 4).

    Arguments:
        point: [N, 3] in metres.
        sphere: the sphere.

    >>> seen = cap(np.array([[0, 0, 2.0]]), BoundingSphere((0, 0, 0), 1.0))
    >>> seen.axis, seen.solid_angle.round(4)
    (array([[ 0.,  0., -1.]]), array([0.8418]))
    """
    xp = namespace(point)
    radial, distance = _radial(point, sphere)
    axis = xp.where(xp.column(distance > 0.0), radial, xp.vector((0.0, 0.0, 1.0), point))
    s = 1.0 / xp.maximum(distance, 1.0)
    square = s * s
    one_minus_cos = square / (1.0 + xp.sqrt(1.0 - square))
    return Cap(axis, one_minus_cos, distance > OUTSIDE)


def _radial(point: Any, sphere: BoundingSphere) -> tuple[Any, Any]:
    """Unit vector to the centre, zero at the centre [N, 3], and the distance in radii [N]."""
    xp = namespace(point)
    offset = (xp.vector(sphere.center, point) - point) * (1.0 / sphere.radius)
    offset = xp.clip(offset, -FAR, FAR)
    distance = xp.sqrt(xp.sum(offset * offset))
    return offset / xp.column(xp.maximum(distance, xp.least(distance))), distance


def cap_to_direction(u: A, cap: Cap[A]) -> A:
    """Equal-area map of the unit square onto the cap (Eq. 5).

    A density on the square gives `pdf_solid_angle = pdf_square / cap.solid_angle`.

    Arguments:
        u: [N, 2] in [0, 1].
        cap: the caps of N points.

    Returns:
        [N, 3] unit directions.
    """
    column = namespace(u).column
    tangent, bitangent = frame(cap.axis)
    x, y = _disk(u)
    m = (x * x + y * y) * cap.one_minus_cos
    q = namespace(u).sqrt(cap.one_minus_cos * (2.0 - m))
    toward: A = cap.axis * column(1.0 - m) + tangent * column(q * x) + bitangent * column(q * y)
    return toward


def direction_to_cap(toward: A, cap: Cap[A]) -> tuple[A, A]:
    """Inverse of `cap_to_direction` (Eq. 6).

    Arguments:
        toward: [N, 3] unit directions.
        cap: the caps of N points.

    Returns:
        square coordinates [N, 2], those of the nearest rim point for directions beside the cap;
        and [N] whether the direction is inside.
    """
    xp = namespace(toward)
    tangent, bitangent = frame(cap.axis)
    delta = toward - cap.axis
    m = 0.5 * xp.sum(delta * delta)
    q = xp.sqrt(xp.maximum(cap.one_minus_cos * (2.0 - m), 1e-30))
    x, y = xp.sum(delta * tangent) / q, xp.sum(delta * bitangent) / q
    rho = x * x + y * y
    shrink = 1.0 / xp.sqrt(xp.maximum(rho, 1.0))
    ahead = m <= AHEAD
    return _square(x * shrink, y * shrink), (rho <= 1.0) & ahead


def encode_point(point: A, sphere: BoundingSphere, r_max: float) -> tuple[A, A]:
    r"""Conditioning of the sampler and the fast map on a shading point (Eq. 7).

    :math:`q = e\,(\tfrac12 + \tfrac12 \ln(d/R) / \ln r_{max})` with the unit direction e from the
    centre and the distance d clipped to [R, r_max R]; :math:`t = \tfrac2\pi \arcsin(R/d)`. So
    directions stay resolved near the lamp, and farther points use the field of r_max.

    Arguments:
        point: [N, 3] in metres.
        sphere: the bounding sphere.
        r_max: the farthest distance in radii.

    Returns:
        (1 + q) / 2, where a grid over the unit cube is asked: [N, 3], its middle at the centre;
        t [N] in (0, 1].
    """
    xp = namespace(point)
    radial, ratio = _clipped(point, sphere, r_max)
    half = 0.25 + xp.log(ratio) * (0.25 / math.log(r_max))
    place = 0.5 - radial * xp.column(half)
    return place, xp.asin(1.0 / ratio) * (2 / math.pi)


def log_distance(point: A, sphere: BoundingSphere, r_max: float) -> A:
    r"""Distance from the centre as for `encode_point`, :math:`\ln(d/R) / \ln r_{max}`: [N].

    Arguments:
        point: [N, 3] in metres.
        sphere: the bounding sphere.
        r_max: the farthest distance in radii.

    Returns:
        from 0 on the sphere and inside to 1 at r_max and beyond.
    """
    _, ratio = _clipped(point, sphere, r_max)
    share: A = namespace(point).log(ratio) * (1.0 / math.log(r_max))
    return share


def _clipped(point: Any, sphere: BoundingSphere, r_max: float) -> tuple[Any, Any]:
    """Unit vector to the centre [N, 3], and the distance in radii within [1, r_max]: [N]."""
    radial, distance = _radial(point, sphere)
    return radial, namespace(point).clip(distance, 1.0, r_max)


def area_to_solid_angle(pdf_area: A, point: A, position: A, normal: A) -> A:
    """`pdf_solid_angle` at a point of a density per area where its ray ends (Eq. 8): [N] in 1/sr.

    Arguments:
        pdf_area: [N] in 1/m².
        point: [N, 3] from where the surface is seen, in metres.
        position, normal: [N, 3] of the surface; the normal on either side.
    """
    xp = namespace(point)
    offset = position - point
    square = xp.sum(offset * offset)
    cosine = abs(xp.sum(offset * normal)) / xp.sqrt(square)
    pdf: A = pdf_area * square / cosine
    return pdf


def flux_estimate(
    radiance: np.ndarray, pdf_area: np.ndarray | float, pdf_projected: np.ndarray
) -> np.ndarray:
    """Flux through the exit surface by single rays (Eq. 9): [N, 3] in W, whose mean it is.

    Arguments:
        radiance: [N, 3] that leaves along the rays, in W/(m² sr).
        pdf_area: [N] of their places, in 1/m².
        pdf_projected: [N] of their directions, per projected solid angle.
    """
    return radiance / (pdf_area * pdf_projected)[:, None]


def light_estimate(
    radiance: np.ndarray, cosine: np.ndarray, pdf_solid_angle: np.ndarray
) -> np.ndarray:
    """Light that reaches a surface by single directions, with brdf one (Eq. 10): [N, 3] in W/m².

    Arguments:
        radiance: [N, 3] that arrives along the directions, in W/(m² sr).
        cosine: [N] of the directions with the surface; behind it there is no light.
        pdf_solid_angle: [N] of the directions; where it is zero, none was drawn.
    """
    drawn = pdf_solid_angle > 0
    weight = np.maximum(cosine, 0) / np.where(drawn, pdf_solid_angle, 1)
    return radiance * np.where(drawn, weight, 0)[:, None]


@dataclass(frozen=True, eq=False)
class Placement:
    """Where a lamp hangs, world = scale · rotation · local + translation (Eq. 11).

    Radiance is that of the brought point and directions; flux grows with the square of the scale.

    Arguments:
        rotation: [3, 3], proper.
        scale: positive.
        translation: [3] in metres.
    """

    rotation: np.ndarray
    scale: float
    translation: np.ndarray

    @staticmethod
    def of(matrix: np.ndarray, name: str, dtype: Any = np.float64) -> Placement:
        """Takes a 4 x 4 matrix apart.

        Arguments:
            matrix: [4, 4], local to world.
            name: what to call the lamp in errors.
            dtype: to calculate in.

        Raises:
            PureLightError: If the matrix mirrors, shears, projects, or scales unevenly.
        """
        matrix = np.asarray(matrix, np.float64).reshape(4, 4)
        linear, translation = matrix[:3, :3], matrix[:3, 3]
        if not np.isfinite(matrix).all() or not np.allclose(
            matrix[3], [0, 0, 0, 1], rtol=0, atol=STRAIGHT
        ):
            raise PureLightError(f"{name}: to_world is not a finite affine transform")
        volume = np.linalg.det(linear)
        if volume <= 0:
            raise PureLightError(
                f"{name}: to_world mirrors or flattens the lamp; use rotations, translations and "
                "a positive uniform scale"
            )
        scale = float(np.cbrt(volume))
        rotation = linear / scale
        if not np.allclose(rotation @ rotation.T, np.eye(3), rtol=0, atol=UNEVEN):
            raise PureLightError(
                f"{name}: to_world shears or scales the axes differently; the light of a lamp is "
                "only known up to a uniform scale"
            )
        return Placement(rotation.astype(dtype), scale, translation.astype(dtype))

    def point_to_local(self, point: np.ndarray) -> np.ndarray:
        """World to luminaire frame: [N, 3]."""
        return ((point - self.translation) @ self.rotation) / self.scale

    def point_to_world(self, point: np.ndarray) -> np.ndarray:
        """Luminaire frame to world: [N, 3]."""
        return self.scale * (point @ self.rotation.T) + self.translation

    def direction_to_local(self, direction: np.ndarray) -> np.ndarray:
        """World to luminaire frame: [N, 3] unit vectors."""
        return direction @ self.rotation

    def direction_to_world(self, direction: np.ndarray) -> np.ndarray:
        """Luminaire frame to world: [N, 3] unit vectors."""
        return direction @ self.rotation.T


def draw_from_map(
    radiance_map: np.ndarray, u: np.ndarray, cap: Cap[np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions by the luminance of a radiance map's cells, even inside a cell (Eq. 13).

    Arguments:
        radiance_map: [N, 16, 16, 3], of which rows go with v and columns with u of the square.
        u: [N, 2] in [0, 1]: the first number chooses the cell, and what is left of it the column.
        cap: of the N points.

    Returns:
        the cell's radiance [N, 3], toward [N, 3], and pdf_solid_angle [N]: zero where the map is
        black, and for points that are not outside.
    """
    rows, cells = np.arange(len(u)), radiance_map.reshape(len(u), MAP_SIDE**2, 3)
    luminance = cells @ LUMINANCE.astype(cells.dtype)
    reached = np.cumsum(luminance, 1)
    target, total = u[:, 0] * reached[:, -1], reached[:, -1]
    cell = np.minimum((reached <= target[:, None]).sum(1), MAP_SIDE**2 - 1)
    own = luminance[rows, cell]
    lit = cap.outside & (own > 0)
    rest = np.clip(1 - (reached[rows, cell] - target) / np.where(lit, own, 1), 0, 1)
    corner = np.stack((cell % MAP_SIDE + rest, cell // MAP_SIDE + u[:, 1]), 1)
    toward = cap_to_direction(corner / MAP_SIDE, cap)
    share = np.where(lit, own, 0) / np.where(lit, total, 1)
    return cells[rows, cell], toward, MAP_SIDE**2 * share / cap.solid_angle
