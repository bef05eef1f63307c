"""The paper's own order: at an occlusion, the frames after it are looked at at once."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.papers.nguyen2002.plain.settings import Settings
from bench.papers.nguyen2002.plain.target import Candidate, Target

__all__ = ["chosen_end", "track_offline"]


def chosen_end(candidates: dict[int, Candidate], settings: Settings) -> int:
    """Frames from an occlusion's beginning to its end, by what was found in some frames."""
    for n, candidate in sorted(candidates.items()):
        if settings.end == "first" and candidate.share <= settings.accept:
            return n
    return min(candidates, key=lambda n: candidates[n].cost)


def track_offline(
    images: Sequence[NDArray[np.uint8]], box: NDArray[np.float64], **parameters: Any
) -> tuple[NDArray[np.float64], list[tuple[int, int]]]:
    """Track a target through a sequence that is known as a whole.

    Parameters
    ----------
    images : sequence of ndarray of uint8, shape (rows, columns, 3)
        BGR.
    box : ndarray of float64, shape (4,)
        The target's in the first.
    **parameters
        See `Settings`.

    Returns
    -------
    boxes : ndarray of float64, shape (n, 4)
    occlusions : list of (int, int)
        First frame and end of each; the sequence's length where it found no end.
    """
    settings = Settings(**parameters)
    target = Target(settings, images[0], box)
    poses, occlusions = [target.last], []
    while (frame := len(poses)) < len(images):
        pose = target.follow(images[frame])
        if pose is not None:
            poses.append(pose)
            continue
        candidates = {
            n: target.look(images[frame + n], n)
            for n in settings.offsets
            if frame + n < len(images)
        }
        if not candidates:
            rest = len(images) - frame
            poses += [target.extrapolated(i) for i in range(1, rest + 1)]
            occlusions.append((frame, len(images)))
            break
        n = chosen_end(candidates, settings)
        end = candidates[n].pose
        poses += [*target.interpolated(end, n), end]
        target.take_again(images[frame + n], end, n)
        occlusions.append((frame, frame + n))
    return np.array([target.box(pose) for pose in poses]), occlusions
