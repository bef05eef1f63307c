"""Renderer of scenes in which the target comes and goes."""

from dataclasses import replace

import numpy as np

from datasets.synthetic.multipart.scene import WalkingScene
from datasets.synthetic.nummiaro2003.campus.plan import VisitPlan
from datasets.synthetic.render.street.ground import Light
from datasets.synthetic.scene import Truth

__all__ = ["VisitScene"]


class VisitScene(WalkingScene):
    """A place where the target comes, and goes again.

    Parameters
    ----------
    plan : VisitPlan
        Who walks where, and when the target is there.
    kind : {'even', 'dappled'}
        Of the light.
    """

    plan: VisitPlan

    def __init__(self, plan: VisitPlan, kind: Light) -> None:
        super().__init__(plan, kind)

    def truth(self) -> Truth:
        """See `Scene.truth`, and `walking_truth` for what there is where the target is.

        Sizes are compared with the first in which he is there.
        """
        truth, present = super().truth(), self.plan.present
        height = self.plan.places[0, :, 2]
        size = height / height[present.argmax()]
        attributes = {**truth.attributes, "scale_change": np.logical_or(size < 0.8, size > 1.25)}
        gone = np.where(present, 1.0, np.nan)[:, None]
        return replace(
            truth,
            boxes=truth.boxes * gone,
            attributes={key: flags & present for key, flags in attributes.items()},
            regions={key: boxes * gone for key, boxes in truth.regions.items()},
        )
