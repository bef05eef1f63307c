"""Scenes of `multipart/1` to `multipart/8`, and of `stress/twin`."""

from datasets.synthetic.multipart.casting import multipart_plan, twin_plan
from datasets.synthetic.multipart.designs import TwinKnobs, WalkingKnobs
from datasets.synthetic.multipart.scene import WalkingScene

__all__ = ["scene"]


def scene(knobs: WalkingKnobs, number: str = "") -> WalkingScene:
    """Renderer and truth of one of the eight, or with a twin; nothing is painted yet."""
    if isinstance(knobs, TwinKnobs):
        plan = twin_plan(knobs.scene, knobs.distance, knobs.twin == "same")
    else:
        plan = multipart_plan(number, knobs.scene)
    return WalkingScene(plan, knobs.light)
