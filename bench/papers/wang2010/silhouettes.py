"""What moves in the scenes, by true silhouettes, and how much of it a map finds."""

from collections.abc import Iterable
from functools import singledispatch

import numpy as np

from bench.evaluation.timing import Remembered
from datasets import Sequence, SequenceError
from datasets.interface import Frames
from datasets.synthetic.wang2010.cup.scene import CupScene
from datasets.synthetic.wang2010.hand import cones
from datasets.synthetic.wang2010.hand.scene import HandScene
from datasets.synthetic.wang2010.table_tennis.scene import TableTennisScene
from trackers.base.interface import Mask

__all__ = ["MovingThings", "found", "found_and_swept", "silhouettes", "target_mask"]


def target_mask(sequence: Sequence, frame: int) -> Mask:
    """Pixels that show the target.

    Raises
    ------
    SequenceError
        For a sequence without masks.
    """
    mask = sequence.mask(frame)
    if mask is None:
        raise SequenceError(
            f"{sequence.name}, {sequence.frame_name(frame)}: there is no mask of the target; "
            "what maps find of it can be measured on sequences with masks only."
        )
    return mask


def found(marked: Mask, truth: Mask) -> dict[str, float]:
    """Recall, precision and F1 of a map of what moves; the precision of an empty map is 0."""
    hits = float(np.count_nonzero(marked & truth))
    in_map, in_truth = float(np.count_nonzero(marked)), float(np.count_nonzero(truth))
    return {
        "recall": hits / in_truth if in_truth else np.nan,
        "precision": hits / in_map if in_map else 0.0,
        "f1": 2 * hits / (in_map + in_truth) if in_map + in_truth else np.nan,
    }


def found_and_swept(marked: Mask, truth: Mask, swept: Mask) -> dict[str, float]:
    """The same, and the precision by where anything moving is in any of the images."""
    return found(marked, truth) | {"precision_swept": found(marked, swept)["precision"]}


class MovingThings:
    """True masks of all that moves, by frame, of a scene whose `silhouettes` are known.

    A thing moves in a frame in which its silhouette is not that of the frame before (in the
    first frame, that of the next).
    """

    def __init__(self, sequence: Sequence) -> None:
        frames = sequence.frames
        self._scene = frames.frames if isinstance(frames, Remembered) else frames
        self._length = len(sequence)
        self._seen: dict[int, list[Mask]] = {}

    def __getitem__(self, frame: int) -> Mask:
        now, other = self._things(frame), self._things(frame - 1 if frame else 1)
        moved = [thing for thing, was in zip(now, other, strict=True) if (thing != was).any()]
        return np.asarray(np.any([np.zeros_like(now[0]), *moved], axis=0))

    def swept(self, frames: Iterable[int]) -> Mask:
        """Where something moving is in one of these frames."""
        return np.asarray(np.any([self[frame] for frame in frames], axis=0))

    def frames(self, most: int) -> list[int]:
        """At most so many frames in which something moves, evenly spaced, with two before them."""
        spaced = np.unique(np.linspace(2, self._length - 1, most).round().astype(int)).tolist()
        return [frame for frame in spaced if self[frame].any()]

    def _things(self, frame: int) -> list[Mask]:
        if frame not in self._seen:
            self._seen[frame] = silhouettes(self._scene, frame)
        return self._seen[frame]


@singledispatch
def silhouettes(scene: Frames, frame: int) -> list[Mask]:
    """Things that move, each with the pixels that show it at mid-exposure, at least to one half.

    Raises
    ------
    SequenceError
        For a scene that is not of the suite.
    """
    raise SequenceError(
        f"{type(scene).__name__}: it is not known what moves there, but the target; say it in "
        f"{__name__}."
    )


@silhouettes.register
def _(scene: TableTennisScene, frame: int) -> list[Mask]:
    """The ball, and the player's bat, hand and arm: what hides light and dark grounds alike."""
    at_bat, tip = scene.play.bat([frame]), scene.play.tip([frame])
    rest = float(scene.play.bat(0)[1])
    grounds = [np.full((*scene.size[::-1], 3), level, np.uint8) for level in (0, 255)]
    for ground in grounds:
        scene._player.draw(ground, at_bat, rest, tip)
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
