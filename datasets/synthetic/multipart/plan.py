"""Plan of a walking scene: people, camera, pillars, and the visible part of the target."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.multipart.walker import GaitPose, Walker, WalkerLook
from trackmark.datasets.synthetic.render.path import quantised
from trackmark.datasets.synthetic.render.prop import Coverage, Prop, coverage_extents, visible_part
from trackmark.datasets.synthetic.render.street.ground import Light
from trackmark.datasets.synthetic.render.street.street import Reach, Street
from trackmark.datasets.synthetic.render.views import SIZE, Views, WalkingPath


@dataclass(frozen=True)
class Person:
    """Person who walks along a path."""

    look: WalkerLook  # clothes and build
    seed: int  # seed of folds and proportions
    stature: float  # [metres]
    path: WalkingPath  # path on the ground


@dataclass(frozen=True)
class Post:
    """Position and thickness of a pillar [metres]."""

    x: float
    z: float
    thickness: float


class WalkPlan:
    """People, camera and pillars of a scene; the first person is the target.

    `places`, shape (people, n, 3), contains for every person and frame the image position (x, y) of
    the ground point below the body's axis, and the body height [pixels].
    """

    def __init__(
        self, seed: int, views: Views, people: Sequence[Person], posts: Sequence[Post] = ()
    ) -> None:
        self.seed = seed
        self.views = views
        self.people = people
        self._posts = posts
        self._streets: dict[Light, Street] = {}
        self.places = np.stack([_places(views, person) for person in people])

    def __len__(self) -> int:
        return len(self.views.x)

    @cached_property
    def walkers(self) -> list[Walker]:
        """Renderer of each person."""
        return [Walker(person.look, person.seed) for person in self.people]

    def street(self, light: Light) -> Street:
        """Return the visible part of the street in a kind of light; it is painted once."""
        if light in self._streets:
            return self._streets[light]
        views = self.views
        ranges = ((float(v.min()), float(v.max())) for v in (views.x, views.shift_x, views.shift_y))
        street = Street(self.seed, SIZE, views.still, Reach(*ranges), light)
        return self._streets.setdefault(light, street)

    @cached_property
    def posts(self) -> list[Prop]:
        """Pillars as drawable objects."""
        street = self.street("even")
        return [street.post(post.x, post.z, post.thickness) for post in self._posts]

    def pose(self, person: int, frame: int) -> GaitPose:
        """Return the gait pose of a person in a frame."""
        path = self.people[person].path
        return GaitPose(*(float(a[frame]) for a in (path.phase, path.stride, path.heading)))

    def depth(self, person: int, frame: int) -> float:
        """Return the depth of a person relative to the camera [metres]."""
        return float(self.people[person].path.z[frame])

    def motion(self, person: int, frame: int) -> Array:
        """Return the motion of a person in the image, right and down [pixels/frame]."""
        first, last = max(frame - 1, 0), min(frame + 1, len(self) - 1)
        displacement = self.places[person, last] - self.places[person, first]
        return np.asarray(displacement[:2] / (last - first))

    def coverage(self, person: int, frame: int) -> Coverage:
        """Return the silhouette of a person in a frame, also outside the image."""
        x, y, height = self.places[person, frame].tolist()
        return self.walkers[person].coverage(x, y, height, self.pose(person, frame))

    def in_picture(self, frame: int) -> list[int]:
        """Return the indices of the people who may be visible in a frame."""
        x, y, height = self.places[:, frame].T
        reach = 0.6 * height
        seen = (x > -reach) & (x < SIZE[0] + reach) & (y > 0) & (y - 1.1 * height < SIZE[1])
        return [int(i) for i in np.flatnonzero(seen)]

    def seen(self, frame: int) -> Coverage:
        """Return the visible part of the target's silhouette."""
        return visible_part(self.coverage(0, frame), self._nearer(frame))

    @cached_property
    def measured(self) -> tuple[Array, Array]:
        """Boxes of the target's silhouette, shape (n, 4), and visible fraction, shape (n,)."""
        boxes, fractions = np.empty((len(self), 4)), np.empty(len(self))
        for frame in range(len(self)):
            whole = self.coverage(0, frame)
            boxes[frame] = coverage_extents(whole)
            fractions[frame] = self.seen(frame)[2].sum() / whole[2].sum()
        return boxes, fractions

    def _nearer(self, frame: int) -> Iterator[Coverage]:
        """Yield the silhouettes of objects in front of the target that may occlude it."""
        depth = self.people[0].path.z[frame]
        x, _, height = self.places[:, frame].T
        overlap = np.abs(x - x[0]) < 0.6 * (height + height[0])
        for person in self.in_picture(frame):
            if overlap[person] and self.people[person].path.z[frame] < depth:
                yield self.coverage(person, frame)
        for post in self.posts:
            if post.z < depth:
                yield post.coverage(self.views[frame])


def _places(views: Views, person: Person) -> Array:
    path = person.path
    x = views.still.column(path.x - views.x, path.z) + views.shift_x
    y = views.still.row(np.zeros(len(views.x)), path.z) + views.shift_y
    return quantised(np.stack([x, y, person.stature * views.still.scale(path.z)], axis=1))


def body_boxes(x: Array, y: Array, height: Array) -> Array:
    """Return boxes from shoulders to ankles of standing persons, shape (n, 4).

    The waist is in the centre of a box. (`x`, `y`) are the ground points below the bodies' axes and
    `height` are the heights of the persons, all in the image [pixels].
    """
    return np.stack([x - 0.12 * height, y - 0.86 * height, 0.24 * height, 0.78 * height], axis=1)


def full_boxes(x: Array, y: Array, height: Array) -> Array:
    """Return boxes of whole persons from head to feet, shape (n, 4); parameters as in `body_boxes`.

    The boxes are as wide as the clothed body. The feet of a long step, seen from the side, lie
    outside.
    """
    return np.stack([x - 0.13 * height, y - height, 0.26 * height, height], axis=1)
