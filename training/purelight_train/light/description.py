"""What every network needs to know of its lamp: sphere, scale, channels, flux."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from purelight_format.measures import BoundingSphere

if TYPE_CHECKING:  # they need Mitsuba, which an exporter does not
    from purelight_train.light.exit_records import ExitRecords
    from purelight_train.light.luminaire import Luminaire
    from purelight_train.light.measured_luminaire import MeasuredLuminaire

R_MAX = 15.0


@dataclass(frozen=True)
class Description:
    """Physical description of a traced lamp.

    Arguments:
        sphere: bounding sphere of the exit surface, metres.
        flux: escaped power per channel in W.
        flux_error: its standard error in W.
        radiance_scale: mean exitant radiance of the channels present, flux / (pi area).
        channels: which of R, G, B carry flux.
        exit_area: area of the exit surface in m².
        paths: emitted paths the flux was measured with.
        r_max: farthest training point, in radii.
        dropped: paths left out because a value was not finite.
        index: refractive index of what the exit surface is made of; 1 where it refracts nothing.
    """

    sphere: BoundingSphere
    flux: tuple[float, float, float]
    flux_error: tuple[float, float, float]
    radiance_scale: float
    channels: tuple[bool, bool, bool]
    exit_area: float
    paths: int
    r_max: float = R_MAX
    dropped: int = 0
    index: float = 1.0

    @staticmethod
    def of(records: ExitRecords, luminaire: Luminaire | MeasuredLuminaire) -> Description:
        """Describe the lamp whose light was recorded."""
        surface = luminaire.exit_surface
        present = np.array(records.channels)
        r, g, b = (float(f) for f in records.flux)
        error_r, error_g, error_b = (float(f) for f in records.flux_error)
        return Description(
            sphere=surface.sphere,
            flux=(r, g, b),
            flux_error=(error_r, error_g, error_b),
            radiance_scale=float(records.flux[present].mean() / (np.pi * surface.area)),
            channels=records.channels,
            exit_area=surface.area,
            paths=records.paths,
            dropped=records.dropped,
            index=luminaire.index,
        )

    @property
    def channel_scale(self) -> list[float]:
        """Mean exitant radiance of each channel in W/(m² sr), what log1p divides by: [3].

        One scale a channel makes the channels of a lamp of one colour the same task, so that its
        hue survives where it is faint. Channels that are absent have the mean of the others.
        """
        present = [f for f in self.flux if f > 0]
        mean = sum(present) / max(len(present), 1)
        return [self.radiance_scale * (f / mean if f > 0 else 1.0) for f in self.flux]

    @property
    def even_map(self) -> list[float]:
        r"""Mean radiance of a map if the lamp shone alike to all sides, in W/(m² sr): [3].

        It is :math:`\Phi / (2 \pi R)^2` at any distance that is not small.
        """
        return [f / (2 * np.pi * self.sphere.radius) ** 2 for f in self.flux]

    def scaled(self, factor: float) -> Description:
        """The same lamp with so many times the power."""
        flux, error = (
            (r * factor, g * factor, b * factor) for r, g, b in (self.flux, self.flux_error)
        )
        scale = self.radiance_scale * factor
        return replace(self, flux=flux, flux_error=error, radiance_scale=scale)

    def to_dict(self) -> dict[str, Any]:
        """A JSON-ready form."""
        return asdict(self)

    @staticmethod
    def from_dict(data: dict[str, Any]) -> Description:
        """Inverse of `to_dict`."""
        sphere = BoundingSphere(tuple(data["sphere"]["center"]), data["sphere"]["radius"])
        lists = {k: tuple(data[k]) for k in ("flux", "flux_error", "channels")}
        return Description(**{**data, **lists, "sphere": sphere})
