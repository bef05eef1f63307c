"""Scenes in which the target enters and leaves the image: people, renderer, ground truth."""

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
    """Sample a person without a bag whose shirt and trousers differ clearly in colour."""
    return casting.sample_person(random, course, wardrobe.sample_street_clothes(random))


def sample_bystander(random: np.random.Generator, course: WalkingPath, other: WalkerLook) -> Person:
    """Sample a person whose colours differ clearly from those of `other`; half carry a bag."""
    worn = other.shirt, other.trousers
    clothes = wardrobe.sample_other_clothes(random, worn)
    bag = wardrobe.sample_bag(random) if random.random() < 0.5 else None
    while bag is not None and any(np.abs(np.subtract(bag, c)).max() < UNLIKE for c in worn):
        bag = wardrobe.sample_bag(random)
    return casting.sample_person(random, course, clothes, bag=bag)


class VisitPlan(WalkPlan):
    """Plan of a scene in which the target is present only during the frames `visit`.

    The first of the `people` is the target. `present`, shape (n,), is True in the frames of `visit`
    in which the target's box overlaps the image. `obstacles` are the objects that can occlude the
    target; `surroundings` is the class that renders the street.
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
        """Objects that can occlude the target."""
        return list(self._obstacles)

    def in_picture(self, frame: int) -> list[int]:
        """See `WalkPlan.in_picture`; an absent target is excluded."""
        return [person for person in super().in_picture(frame) if person or self.present[frame]]

    def seen(self, frame: int) -> Coverage:
        """See `WalkPlan.seen`; the silhouette of an absent target is empty."""
        left, top, alpha = super().seen(frame)
        return left, top, alpha if self.present[frame] else np.zeros_like(alpha)


class VisitScene(WalkingScene):
    """Scene that the target enters and leaves."""

    plan: VisitPlan

    def truth(self) -> SceneTruth:
        """Return the ground truth.

        While the target is absent, boxes are NaN and attributes are False. The attribute
        `scale_change` compares with the first frame in which the target is present. For the other
        attributes see `WalkingScene`.
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
