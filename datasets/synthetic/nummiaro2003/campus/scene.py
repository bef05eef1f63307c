"""People who come and go: their clothes, the plan of a visit, its renderer and truth."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.multipart import casting, wardrobe
from trackmark.datasets.synthetic.multipart.look import WalkerLook
from trackmark.datasets.synthetic.multipart.plan import Person, WalkPlan, body_boxes
from trackmark.datasets.synthetic.multipart.scene import WalkingScene
from trackmark.datasets.synthetic.render.attributes import rescaled
from trackmark.datasets.synthetic.render.prop import Coverage, Prop
from trackmark.datasets.synthetic.render.street.ground import Light
from trackmark.datasets.synthetic.render.street.street import Reach, Street
from trackmark.datasets.synthetic.render.views import SIZE, Views, WalkingPath
from trackmark.datasets.synthetic.scene import SceneTruth

# Colours differ clearly whose channels differ by this much in one of them [grey levels].
UNLIKE = 40


def target(random: np.random.Generator, course: WalkingPath) -> Person:
    """Someone in a shirt and trousers that differ clearly, without a bag."""
    return casting.dressed(random, course, wardrobe.street_clothes(random))


def bystander(random: np.random.Generator, course: WalkingPath, other: WalkerLook) -> Person:
    """Someone dressed in clearly other colours than another person; half of them carry a bag."""
    worn = other.shirt, other.trousers
    clothes = wardrobe.other_clothes(random, worn)
    bag = wardrobe.bag(random) if random.random() < 0.5 else None
    while bag is not None and any(np.abs(np.subtract(bag, c)).max() < UNLIKE for c in worn):
        bag = wardrobe.bag(random)
    return casting.dressed(random, course, clothes, bag=bag)


class VisitPlan(WalkPlan):
    """Plan of a visit: before and after it all is as it is, without the target.

    The target, who is the first of the `people`, takes part in the frames of `visit` as far as his
    box reaches into the picture: these are `present`, shape (n,). `obstacles` are all that stands
    before him at some time, `surroundings` the street or what there is instead.
    """

    def __init__(
        self,
        seed: int,
        views: Views,
        people: Sequence[Person],
        visit: slice,
        obstacles: Sequence[Prop] = (),
        surroundings: type[Street] = Street,
    ) -> None:
        super().__init__(seed, views, people)
        self._obstacles = obstacles
        self._surroundings = surroundings
        low, size = np.split(body_boxes(*self.places[0].T), 2, axis=1)
        self.present: NDArray[np.bool_] = np.zeros(len(self), np.bool_)
        self.present[visit] = np.all((low < SIZE) & (low + size > 0), axis=1)[visit]

    def street(self, light: Light) -> Street:
        return self._surroundings(self.seed, SIZE, self.views.still, Reach(), light)

    @cached_property
    def posts(self) -> list[Prop]:
        """What may hide the target, to be drawn."""
        return list(self._obstacles)

    def in_picture(self, frame: int) -> list[int]:
        """See `WalkPlan.in_picture`; an absent target is not."""
        return [person for person in super().in_picture(frame) if person or self.present[frame]]

    def seen(self, frame: int) -> Coverage:
        """See `WalkPlan.seen`; of an absent target nothing is."""
        left, top, alpha = super().seen(frame)
        return left, top, alpha if self.present[frame] else np.zeros_like(alpha)


class VisitScene(WalkingScene):
    """A place where the target comes, and goes again."""

    plan: VisitPlan

    def __init__(self, plan: VisitPlan, kind: Light) -> None:
        super().__init__(plan, kind)

    def truth(self) -> SceneTruth:
        """See `Scene.truth`, and `WalkingScene` for what there is where he is.

        Sizes are compared with the first in which he is there.
        """
        truth, present = super().truth(), self.plan.present
        changed = rescaled(self.plan.places[0, :, 2], int(present.argmax()))
        attributes = {**truth.attributes, "scale_change": changed}
        gone = np.where(present, 1.0, np.nan)[:, None]
        return replace(
            truth,
            boxes=truth.boxes * gone,
            attributes={key: flags & present for key, flags in attributes.items()},
            regions={key: boxes * gone for key, boxes in truth.regions.items()},
        )
