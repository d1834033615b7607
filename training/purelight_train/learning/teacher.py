"""Teacher (paper Sec. 3.2): positional density times a directional flow gives radiance."""

from __future__ import annotations

import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from purelight_train.light.description import Description
from purelight_train.light.exit_records import ExitRecords, settle
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.light_tracing import BATCH
from purelight_train.light.luminaire import Luminaire
from purelight_train.light.measured_luminaire import MeasuredLuminaire
from purelight_train.light.positional_density import PositionalDensity
from purelight_train.light.ray_chart import direction_to_square
from purelight_train.networks.coupling_flow import CouplingFlow
from purelight_train.networks.encodings import one_blob
from purelight_train.networks.surface_network import make_grid
from purelight_train.presets import Preset

NORMAL_BINS = 16
LEVEL = 1e-4  # sine of the angle of a normal to the vertical
EVALUATED = 1 << 15
STEEPEST = 16.0


class DirectionalFlow(nn.Module):
    r"""Density of the outgoing direction given position, normal and channel.

    Directions live on the unit disk of the projected hemisphere, mapped to the square, so a
    density p on the square is :math:`p_{projected} = p / \pi`. The context is
    [grid(position), one-blob(normal's polar angles), one-hot(channel)].
    """

    centre: Tensor

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__()
        sphere = description.sphere
        self.register_buffer("centre", torch.tensor(sphere.center), persistent=False)
        self.radius = sphere.radius
        self.grid = make_grid(preset.teacher_grid)
        size = preset.teacher_flow
        self.flow = CouplingFlow(
            self.grid.size + 2 * NORMAL_BINS + 3,
            size.couplings, size.network.width, size.network.depth, size.bins,
        )  # fmt: skip

    def context(self, position: Tensor, normal: Tensor, channel: Tensor) -> Tensor:
        """Context of the flow: [N, 3], [N, 3], channel index [N] -> [N, C]."""
        unit = (position - self.centre) * (0.5 / self.radius) + 0.5
        polar = torch.acos(normal[:, 2].clamp(-1, 1)) / math.pi
        # Of level faces it is rounding that decides; they have one azimuth
        level = normal[:, :2].norm(dim=1) < LEVEL
        azimuth = torch.atan2(normal[:, 1], normal[:, 0]) / (2 * math.pi) + 0.5
        azimuth = torch.where(level, torch.zeros_like(azimuth), azimuth)
        one_hot = nn.functional.one_hot(channel, 3).to(position.dtype)
        return torch.cat(
            (
                self.grid(unit),
                one_blob(polar, NORMAL_BINS),
                one_blob(azimuth, NORMAL_BINS),
                one_hot,
            ),
            dim=-1,
        )

    def log_pdf_projected(
        self, position: Tensor, normal: Tensor, outgoing: Tensor, channel: Tensor
    ) -> Tensor:
        """Log-density per projected solid angle: [N]."""
        square = direction_to_square(outgoing, normal)
        context = self.context(position, normal, channel)
        return self.flow.log_density(square, context) - math.log(math.pi)


class PowerBatches:
    """Batches of exit records for the weighted likelihood of Eq. 6.

    A record and a channel are drawn in proportion to the record's power in that channel, which
    is the importance weight of Eq. 6 moved into the choice of the sample.
    """

    def __init__(self, records: ExitRecords, device: torch.device) -> None:
        self.tensors = [
            torch.from_numpy(a).to(device)
            for a in (records.position, records.shading, records.direction)
        ]
        power = records.weight.sum(0, dtype=np.float64)
        self.channel_share = power / power.sum()
        self.cumulative = [np.cumsum(records.weight[:, c], dtype=np.float64) for c in range(3)]

    def draw(self, rng: np.random.Generator, size: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Position, shading normal, outgoing [size, 3] and channel [size]."""
        channel = np.sort(rng.choice(3, size=size, p=self.channel_share))
        u = rng.random(size)
        index = np.concatenate([
            np.searchsorted(sums, u[channel == c] * sums[-1]) if sums[-1] > 0 else np.empty(0, int)
            for c, sums in enumerate(self.cumulative)
        ])  # fmt: skip
        chosen = torch.from_numpy(np.minimum(index, len(self.cumulative[0]) - 1).astype(np.int64))
        position, normal, outgoing = (t[chosen.to(t.device)] for t in self.tensors)
        return position, normal, outgoing, torch.from_numpy(channel).to(position.device)


class FreshBatches:
    """`PowerBatches` of records generated while they are used, as in the paper.

    Memory is that of one batch of paths, whatever their number; as many rows are drawn from it as
    it has records.
    """

    def __init__(self, luminaire: Luminaire | MeasuredLuminaire, device: torch.device) -> None:
        self.luminaire, self.device = luminaire, device
        self.batches: PowerBatches | None = None
        self.left = 0

    def draw(self, rng: np.random.Generator, size: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """As `PowerBatches.draw`."""
        if self.batches is None or self.left <= 0:
            records = self.luminaire.trace(BATCH, int(rng.integers(1 << 31)))
            settled, _ = settle(records, self.luminaire.exit_surface)
            self.batches, self.left = PowerBatches(settled, self.device), len(settled)
        self.left -= size
        return self.batches.draw(rng, size)


class Teacher:
    """Radiance of the lamp: exitance(x) times pdf_projected(outgoing | x), per channel.

    The flow's projected solid angle is that of the scene's shading normal n_s; the factor
    cos_s / cos turns it into that of the geometric normal. No light leaves below the horizon of
    either. At the geometric horizon, where a density that is not quite zero is divided by nearly
    nothing, the factor is at most `STEEPEST`.
    """

    def __init__(
        self,
        description: Description,
        surface: ExitSurface,
        density: PositionalDensity,
        flow: DirectionalFlow,
    ) -> None:
        self.description, self.surface = description, surface
        self.density, self.flow = density, flow

    @torch.no_grad()
    def radiance(
        self,
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
        outgoing: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """Radiance in W/(m² sr): three of [N, 3] -> [N, 3]."""
        shading = self._shading_normals(position, normal, outgoing)
        cosine = np.einsum("nd,nd->n", normal, outgoing)
        shaded = np.maximum(np.einsum("nd,nd->n", shading, outgoing), 0)
        ratio = shaded / np.maximum(np.maximum(cosine, shaded / STEEPEST), 1e-6)
        result = self.density.exitance(position, normal) * ratio[:, None].astype(np.float32)
        device = self.flow.centre.device
        for i in range(0, len(position), EVALUATED):
            part = [
                torch.from_numpy(a[i : i + EVALUATED]).to(device)
                for a in (position, shading, outgoing)
            ]
            for channel in range(3):
                if self.description.channels[channel]:
                    index = torch.full((len(part[0]),), channel, device=device)
                    log = self.flow.log_pdf_projected(part[0], part[1], part[2], index)
                    result[i : i + EVALUATED, channel] *= torch.exp(log).cpu().numpy()
        return result

    def _shading_normals(
        self,
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
        outgoing: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """The scene's shading normals where a viewer just before the points meets them."""
        ahead = 1e-3 * self.surface.sphere.radius
        hits = self.surface.intersect(position + ahead * outgoing, -outgoing)
        shading = normal.copy()
        found = hits.index
        shading[found] = self.surface.shading_normals(position[found], normal[found], hits.triangle)
        return shading
