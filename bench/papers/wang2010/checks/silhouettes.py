"""Silhouettes of what moves in the scenes: the target, what holds it, whoever comes with it."""

from functools import singledispatch

import numpy as np

from datasets import SequenceError
from datasets.interface import Frames
from datasets.synthetic.wang2010.cup.scene import CupScene
from datasets.synthetic.wang2010.hand import cones
from datasets.synthetic.wang2010.hand.scene import HandScene
from datasets.synthetic.wang2010.table_tennis.scene import TableTennisScene
from trackers.base.interface import Mask

__all__ = ["silhouettes"]


@singledispatch
def silhouettes(scene: Frames, frame: int) -> list[Mask]:
    """Things that move, each with the pixels that show it at mid-exposure, at least to one half.

    Parameters
    ----------
    scene : Scene
        Of the suite.
    frame : int
        From 0.

    Raises
    ------
    SequenceError
        For another scene.
    """
    raise SequenceError(
        f"{type(scene).__name__}: it is not known what moves there, but the target; say it in "
        f"{__name__}."
    )


@silhouettes.register
def _(scene: TableTennisScene, frame: int) -> list[Mask]:
    """The ball, and the player's bat, hand and arm: what hides light and dark grounds alike."""
    at_bat = scene.play.bat([frame])
    rest = float(scene.play.bat(0)[1])
    grounds = [np.full((*scene.size[::-1], 3), level, np.uint8) for level in (0, 255)]
    for ground in grounds:
        scene._player.draw(ground, at_bat, rest)
    dark, light = (ground[:, :, 0].astype(np.int64) for ground in grounds)
    return [scene.mask(frame), np.asarray(light - dark < 128)]


@silhouettes.register
def _(scene: HandScene, frame: int) -> list[Mask]:
    """The hand with its sleeve."""
    shape = scene.size[::-1]
    skin, cloth = (
        cones.cover(scene.hand.cones[frame], material, *shape)
        for material in (cones.SKIN, cones.CLOTH)
    )
    return [np.asarray(2 * (skin + cloth) >= cones.FINE**2)]


@silhouettes.register
def _(scene: CupScene, frame: int) -> list[Mask]:
    """The cup with the hand and the arm that carry it, as far as nothing is before them."""
    plan = scene.plan
    carried = scene.setting.carried.at(plan.middle(frame), float(plan.tilt(frame)))[..., 3]
    mask = carried * (1 - scene.setting.hidden) >= 0.5
    return [np.asarray(mask[:, ::-1] if plan.mirrored else mask)]
