"""Scenes of `stress/twin`: a second person comes near the target."""

from datasets.synthetic.multipart.casting import twin_plan
from datasets.synthetic.multipart.knobs import TwinKnobs
from datasets.synthetic.multipart.scene import WalkingScene

__all__ = ["scene"]


def scene(knobs: TwinKnobs) -> WalkingScene:
    """Renderer and truth; nothing is painted yet."""
    plan = twin_plan(knobs.scene, knobs.distance, knobs.twin == "same")
    return WalkingScene(plan, knobs.light)
