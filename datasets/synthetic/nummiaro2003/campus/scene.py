"""People who arrive and leave: clothes, plan of a visit, renderer and ground truth."""

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

UNLIKE = 40  # minimum difference in one channel of clearly different colours [grey levels]


def sample_target(random: np.random.Generator, course: WalkingPath) -> Person:
    """Sample a person in clearly different shirt and trousers, without a bag."""
    return casting.sample_person(random, course, wardrobe.sample_street_clothes(random))


def sample_bystander(random: np.random.Generator, course: WalkingPath, other: WalkerLook) -> Person:
    """Sample a person in colours clearly unlike another person's; half of them carry a bag."""
    worn = other.shirt, other.trousers
    clothes = wardrobe.sample_other_clothes(random, worn)
    bag = wardrobe.sample_bag(random) if random.random() < 0.5 else None
    while bag is not None and any(np.abs(np.subtract(bag, c)).max() < UNLIKE for c in worn):
        bag = wardrobe.sample_bag(random)
    return casting.sample_person(random, course, clothes, bag=bag)


class VisitPlan(WalkPlan):
    """Plan of a visit: the surroundings continue before and after it, without the target.

    The target, the first of the `people`, is present in the frames of `visit` in which its box
    overlaps the image: these are `present`, shape (n,). `obstacles` are the objects that can hide
    it, `surroundings` the class of the street.
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
        """Props that can hide the target."""
        return list(self._obstacles)

    def in_picture(self, frame: int) -> list[int]:
        """See `WalkPlan.in_picture`; an absent target is excluded."""
        return [person for person in super().in_picture(frame) if person or self.present[frame]]

    def seen(self, frame: int) -> Coverage:
        """See `WalkPlan.seen`; the silhouette of an absent target is empty."""
        left, top, alpha = super().seen(frame)
        return left, top, alpha if self.present[frame] else np.zeros_like(alpha)


class VisitScene(WalkingScene):
    """Place where the target arrives and leaves."""

    plan: VisitPlan

    def __init__(self, plan: VisitPlan, kind: Light) -> None:
        super().__init__(plan, kind)

    def truth(self) -> SceneTruth:
        """Return the ground truth; it is NaN or False while the target is absent.

        Sizes are compared with the first frame in which the target is present. For the attributes
        see `WalkingScene`.
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
