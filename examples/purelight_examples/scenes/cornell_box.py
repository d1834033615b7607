"""The Cornell box with a lamp that hangs from its ceiling."""

from __future__ import annotations

from dataclasses import dataclass

import trimesh

from purelight_examples.luminaires.lamp_scene import Part, matt
from purelight_examples.scenes.furniture import boxes, wall
from purelight_examples.scenes.interior import Interior, View, cord, hung
from purelight_examples.scenes.place import Place

WHITE, RED, GREEN = (0.73, 0.71, 0.68), (0.63, 0.065, 0.05), (0.14, 0.45, 0.091)


@dataclass(frozen=True)
class CornellBox(Interior):
    """A box, open to the camera, with two blocks.

    Arguments:
        side: of the box.
        lamp: that hangs in it, `drop` below the ceiling.
    """

    name: str = "cornell_box"
    side: float = 1.6
    lamp: str = "medieval"
    drop: float = 0.1
    daylight: float = 0.0

    def view(self) -> View:
        """From the open side."""
        middle = 0.5 * self.side
        return View((0.0, -1.9 * self.side, middle), (0.0, 0.0, middle), 40.0)

    def places(self) -> dict[str, list[Place]]:
        """The lamp in the middle."""
        return {self.lamp: [hung(self.lamp, 0.0, 0.0, self.side, self.drop)]}

    def parts(self) -> list[Part]:
        """Walls, blocks, and the cord."""
        h = 0.5 * self.side
        white = trimesh.util.concatenate([
            wall((0, 0, 0), 3, (h, h)), wall((0, 0, 2 * h), -3, (h, h)),
            wall((0, h, h), -2, (h, h)),
        ])  # fmt: skip
        place = self.places()[self.lamp][0]
        blocks = [
            self._block(0.6, (0.33, -0.3), -17.0, 0.3),
            self._block(0.6, (-0.35, 0.35), 20.0, 0.62),
        ]
        return [
            matt("white", white, WHITE),
            matt("red", wall((-h, 0, h), 1, (h, h)), RED),
            matt("green", wall((h, 0, h), -1, (h, h)), GREEN),
            matt("blocks", trimesh.util.concatenate(blocks), WHITE),
            matt("cord", cord(place, self.side, self.lamp), (0.05, 0.05, 0.05)),
        ]

    def _block(
        self, width: float, at: tuple[float, float], turn: float, tall: float
    ) -> trimesh.Trimesh:
        h = 0.5 * self.side
        block = boxes([((0, 0, tall * h), (width * h, width * h, 2 * tall * h))])
        matrix = trimesh.transformations.rotation_matrix(turn / 57.29578, [0, 0, 1])
        return block.apply_transform(matrix).apply_translation([at[0] * h, at[1] * h, 0.001])
