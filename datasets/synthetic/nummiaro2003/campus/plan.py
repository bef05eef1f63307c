"""Plans in which the target comes and goes, among things that may hide him."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.multipart.plan import Person, Plan
from datasets.synthetic.multipart.scene import body_boxes
from datasets.synthetic.render.prop import Coverage, Prop
from datasets.synthetic.render.street.ground import Light
from datasets.synthetic.render.street.street import Reach, Street
from datasets.synthetic.render.views import SIZE, Views

__all__ = ["VisitPlan"]


class VisitPlan(Plan):
    """Plan of a visit: before and after it all is as it is, without the target.

    Parameters
    ----------
    seed : int
        Of street, light and noise.
    views : Views
        The camera, which stands still.
    people : sequence of Person
        The target first.
    visit : slice
        Frames in which the target takes part, where his box reaches into the picture.
    obstacles : sequence of Prop
        All that stands before the target at some time.
    surroundings : type
        The street, or what there is instead.

    Attributes
    ----------
    present : ndarray of bool, shape (n,)
        Where the target is there.
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
        """See `Plan.street`."""
        return self._surroundings(self.seed, SIZE, self.views.still, Reach(), light)

    @cached_property
    def posts(self) -> list[Prop]:
        """What may hide the target, to be drawn."""
        return list(self._obstacles)

    def in_picture(self, frame: int) -> list[int]:
        """See `Plan.in_picture`; an absent target is not."""
        return [person for person in super().in_picture(frame) if person or self.present[frame]]

    def seen(self, frame: int) -> Coverage:
        """See `Plan.seen`; of an absent target nothing is."""
        left, top, alpha = super().seen(frame)
        return left, top, alpha if self.present[frame] else np.zeros_like(alpha)
