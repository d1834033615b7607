"""Frames, disk maps and caps in torch; the same formulas as `purelight_format.measures`."""

from __future__ import annotations

import math

import torch
from torch import Tensor

QUARTER_PI = math.pi / 4


def frame(axis: Tensor) -> tuple[Tensor, Tensor]:
    """Tangent and bitangent of unit axes [N, 3], right-handed, singular only at -Z."""
    x, y, z = axis.unbind(-1)
    rho2 = x * x + y * y
    below = z < 0
    k = torch.where(below, (1 - z) / rho2.clamp(min=1e-20), 1 / (1 + z.clamp(min=0)))
    pole = below & (rho2 < 1e-20)
    xx = torch.where(pole, 2.0, k * x * x)
    xy = torch.where(pole, 0.0, k * x * y)
    yy = torch.where(pole, 0.0, k * y * y)
    return torch.stack((1 - xx, -xy, -x), -1), torch.stack((-xy, 1 - yy, -y), -1)


def square_to_disk(u: Tensor) -> Tensor:
    """Equal-area concentric map (Shirley and Chiu 1997): [N, 2] in [0,1]² -> unit disk."""
    a, b = (2 * u - 1).unbind(-1)
    horizontal = a.abs() > b.abs()
    r = torch.where(horizontal, a, b)
    safe = torch.where(r == 0, 1.0, r)
    phi = torch.where(horizontal, QUARTER_PI * b / safe, 2 * QUARTER_PI - QUARTER_PI * a / safe)
    return torch.stack((r * torch.cos(phi), r * torch.sin(phi)), -1)


def disk_to_square(p: Tensor) -> Tensor:
    """Inverse of `square_to_disk`: unit disk [N, 2] -> [0,1]²."""
    x, y = p.unbind(-1)
    horizontal = x.abs() > y.abs()
    radius = torch.sqrt(x * x + y * y)
    major, minor = torch.where(horizontal, x, y), torch.where(horizontal, y, x)
    r = torch.copysign(radius, major)
    safe = torch.where(major == 0, 1.0, major)
    t = r * torch.atan(minor / safe) / QUARTER_PI
    square = torch.where(horizontal[:, None], torch.stack((r, t), -1), torch.stack((t, r), -1))
    return (0.5 * square + 0.5).clamp(0, 1)


def direction_to_square(outgoing: Tensor, normal: Tensor) -> Tensor:
    """Outgoing directions [N, 3] about normals [N, 3] on the projected hemisphere's square [N, 2].

    Area on the unit disk is projected solid angle, so a density p on the square is
    `pdf_projected = p / pi`.
    """
    tangent, bitangent = frame(normal)
    disk = torch.stack(((outgoing * tangent).sum(-1), (outgoing * bitangent).sum(-1)), -1)
    return disk_to_square(disk)


def cap(point: Tensor, centre: Tensor, radius: float) -> tuple[Tensor, Tensor]:
    """Axis [N, 3] and 1 - cos(half-angle) [N] of the cap a sphere covers from points [N, 3]."""
    offset = centre - point
    distance = offset.norm(dim=-1)
    s2 = (radius / distance.clamp(min=1e-30)).clamp(max=1) ** 2
    up = torch.tensor([0.0, 0.0, 1.0], dtype=point.dtype, device=point.device)
    axis = torch.where((distance > 0)[:, None], offset / distance.clamp(min=1e-30)[:, None], up)
    return axis, s2 / (1 + torch.sqrt(1 - s2))


def cap_to_direction(u: Tensor, axis: Tensor, one_minus_cos: Tensor) -> Tensor:
    """Equal-area map of the square [N, 2] onto the cap: unit directions [N, 3]."""
    tangent, bitangent = frame(axis)
    x, y = square_to_disk(u).unbind(-1)
    m = (x * x + y * y) * one_minus_cos
    q = torch.sqrt(one_minus_cos * (2 - m))
    return axis * (1 - m)[:, None] + q[:, None] * (x[:, None] * tangent + y[:, None] * bitangent)


def direction_to_cap(toward: Tensor, axis: Tensor, one_minus_cos: Tensor) -> tuple[Tensor, Tensor]:
    """Inverse of `cap_to_direction`: square coordinates [N, 2] and whether inside [N]."""
    tangent, bitangent = frame(axis)
    delta = toward - axis
    m = 0.5 * (delta * delta).sum(-1)
    q = torch.sqrt((one_minus_cos * (2 - m)).clamp(min=1e-30))
    disk = torch.stack(((delta * tangent).sum(-1) / q, (delta * bitangent).sum(-1) / q), -1)
    inside = ((disk * disk).sum(-1) <= 1) & (m <= 1.5)  # not the far side of the sphere
    return disk_to_square(disk / disk.norm(dim=-1, keepdim=True).clamp(min=1)), inside
