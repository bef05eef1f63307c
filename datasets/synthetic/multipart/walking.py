"""Scenes of `multipart/1` to `multipart/8`: people who walk in a street."""

from datasets.synthetic.multipart.casting import multipart_plan
from datasets.synthetic.multipart.knobs import WalkingKnobs
from datasets.synthetic.multipart.scene import WalkingScene

__all__ = ["scene"]


def scene(knobs: WalkingKnobs, number: str) -> WalkingScene:
    """Renderer and truth of one of the eight; nothing is painted yet."""
    return WalkingScene(multipart_plan(number, knobs.scene), knobs.light)
