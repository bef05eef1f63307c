"""Renderer and ground truth of `multipart/1` to `multipart/8`, `stress/pillar`, `stress/twin`.

Boxes are computed without rendering; silhouettes are rendered when they are needed.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.multipart import casting, routes
from trackmark.datasets.synthetic.multipart.casting import twin_plan
from trackmark.datasets.synthetic.multipart.designs import (
    DESIGNS,
    Clothes,
    Design,
    PillarParameters,
    TwinParameters,
    TwoColouredParameters,
    WalkingParameters,
)
from trackmark.datasets.synthetic.multipart.plan import (
    Person,
    Post,
    WalkPlan,
    body_boxes,
    full_boxes,
)
from trackmark.datasets.synthetic.render.attributes import occluded, out_of_view, rescaled, turning
from trackmark.datasets.synthetic.render.camera import Camera, slow_exposure
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.street.ground import Light
from trackmark.datasets.synthetic.render.street.street import Street
from trackmark.datasets.synthetic.render.views import (
    FRAMES_PER_SECOND,
    SIZE,
    Views,
    WalkingPath,
    sample_fixed_views,
    sample_following_views,
)
from trackmark.datasets.synthetic.scene import (
    SceneTruth,
    SyntheticScene,
    part_generator,
    paste_window,
)

# times at which the first and the last person pass in front of the target [sequence lengths]
FIRST, LAST = 0.16, 0.88

# time of the last person if a person in the target's clothes crosses later [sequence lengths]
LAST_BEFORE_CROSSING = 0.74

# range of the time at which a person in the target's clothes crosses [sequence lengths]
CROSSING = 0.87, 0.9

CLEAR = 0.6  # minimum difference in depth between the target and people behind it [metres]

# thickness ranges of lamp posts, and of the pillar in `stress/pillar` [metres]
POSTS, PILLARS = (0.10, 0.14), (0.35, 0.5)

Generators = Callable[[str], Generator]


@lru_cache(maxsize=4)
def multipart_plan(
    number: str,
    scene: int,
    *,
    thickness: tuple[float, float] = POSTS,
    clothes: Clothes = "neutral",
) -> WalkPlan:
    """Return the plan of a sequence.

    `thickness`: range of the thickness of its posts [metres]. `clothes`: those of the people who
    overtake the target; all else is equal in both variants.
    """
    design = DESIGNS[number]

    def generator(part: str) -> Generator:
        return part_generator(scene, f"multipart/{number} {part}")

    if design.follows:
        path = routes.sample_followed_path(generator("target way"), design)
        views = sample_following_views(generator("camera"), path)
    else:
        views = sample_fixed_views(generator("camera"), design.length)
        path = routes.sample_path_in_view(generator("target way"), design, views)
    target = _target(generator, design, path)
    others: list[WalkingPath] = []
    posts = []
    for i in range(design.posts):
        random = generator(f"post {i}")
        others.append(routes.sample_post_place(random, views, path, others))
        place = float(others[-1].x[0]), float(others[-1].z[0])
        posts.append(Post(*place, random.uniform(*thickness)))
    people = [target, *_overtaking(generator, design, views, target, others, clothes)]
    people += _crossing(generator, design, views, target, others)
    people += _passers(generator, design, views, target, others)
    return WalkPlan(casting.sample_seed(generator("street")), views, people, posts)


def _target(generator: Generators, design: Design, path: WalkingPath) -> Person:
    random = generator("target clothes")
    if design.two_coloured:
        clothes = casting.sample_two_coloured_clothes(random)
    else:
        clothes = casting.sample_plain_clothes(random)
    person = casting.sample_person(generator("target"), path, clothes, weaves=("plain", "knit"))
    look = replace(person.look, bulk=random.uniform(1.05, 1.15), loose=random.uniform(1.25, 1.4))
    if design.jacket:
        look = replace(look, jacket=clothes[0], shirt=casting.scale_brightness(clothes[0], 0.6))
    if design.bag:
        look = replace(look, bag=casting.scale_brightness(clothes[0], 0.75))
    return replace(person, look=look)


def _overtaking(
    generator: Generators,
    design: Design,
    views: Views,
    target: Person,
    others: list[WalkingPath],
    clothes: Clothes,
) -> list[Person]:
    """Return two-coloured people who overtake the target, and append their paths to `others`."""
    people = []
    for i in range(design.overtaking):
        random = generator(f"overtaking {i}")
        meeting_frame = (i + random.uniform(0.4, 0.6)) / design.overtaking * design.length
        others.append(
            routes.sample_overtaking_path(
                random, views, target.path, others, meeting_frame, design.pace
            )
        )
        if clothes == "exchanged":
            look = casting.exchange_colours(target.look)
        else:
            shirt, trousers = casting.sample_two_coloured_clothes(generator(f"clothes {i}"))
            look = replace(target.look, shirt=shirt, trousers=trousers, jacket=None, bag=None)
        people.append(Person(look, casting.sample_seed(random), 1.06 * target.stature, others[-1]))
    return people


def _crossing(
    generator: Generators, design: Design, views: Views, target: Person, others: list[WalkingPath]
) -> list[Person]:
    """Return the person in the target's clothes who crosses, if the design has one."""
    if not design.crossing:
        return []
    random = generator("crossing")
    others.append(routes.sample_crossing_path(random, views, target.path, others, CROSSING))
    return [Person(target.look, casting.sample_seed(random), target.stature, others[-1])]


def _passers(
    generator: Generators, design: Design, views: Views, target: Person, others: list[WalkingPath]
) -> list[Person]:
    """Return people in other clothes around the target, and append their paths to `others`."""
    start = len(others)
    last = LAST_BEFORE_CROSSING if design.crossing else LAST
    for i in range(design.before):
        random = generator(f"way before {i}")
        share = (i + random.uniform(0.25, 0.75)) / design.before
        meeting_frame = (FIRST + (last - FIRST) * share) * design.length
        others.append(
            routes.sample_path_before_target(random, views, target.path, others, meeting_frame)
        )
    for i in range(design.behind):
        random = generator(f"way behind {i}")
        nearest = design.depths[1] + CLEAR
        others.append(routes.sample_path_behind_target(random, views, target.path, others, nearest))
    people = []
    for i, path in enumerate(others[start:]):
        random = generator(f"person {i}")
        people.append(casting.sample_person(random, path, casting.sample_wardrobe_clothes(random)))
    return people


TURNING = 30.0  # minimum rotation per second for the attribute `turning` [degrees]


def scene(parameters: WalkingParameters, number: str = "") -> "WalkingScene":
    """Return the scene, which gives the ground truth and renders frames on request."""
    if isinstance(parameters, TwinParameters):
        plan = twin_plan(parameters.scene, parameters.distance, parameters.twin == "same")
    elif isinstance(parameters, PillarParameters):
        plan = multipart_plan(parameters.number, parameters.scene, thickness=PILLARS)
    elif isinstance(parameters, TwoColouredParameters):
        plan = multipart_plan(number, parameters.scene, clothes=parameters.others)
    else:
        plan = multipart_plan(number, parameters.scene)
    return WalkingScene(plan, parameters.light)


def _truth(plan: WalkPlan, shade: NDArray[np.bool_]) -> SceneTruth:
    """Return the ground truth; `shade`, shape (n,), are the flags of the attribute `shade`.

    `boxes` contain the body from shoulders to ankles. The region `full` contains the whole person,
    `tight` the silhouette. The attributes are:

    - `occlusion`: less than 0.9 of the target is visible.
    - `out_of_view`: a part of the box `full` is outside the image.
    - `scale_change`: the size is outside 0.8 to 1.25 times the first size.
    - `turning`: the target turns by more than 30 degrees per second.
    - `clutter`: the axis of another person is within two box widths of the target's axis.
    - `shade`: the target is in the shade of trees.
    """
    x, y, height = plan.places[0].T
    full = full_boxes(x, y, height)
    tight, visibility = plan.measured
    near = np.abs(plan.places[1:, :, 0] - x) < 2 * 0.24 * height
    return SceneTruth(
        body_boxes(x, y, height),
        visibility,
        {
            "occlusion": occluded(visibility),
            "out_of_view": out_of_view(full),
            "scale_change": rescaled(height),
            "turning": turning(plan.people[0].path.heading, TURNING),
            "clutter": near.any(axis=0),
            "shade": shade,
        },
        regions={"full": full, "tight": tight},
    )


EXPOSURE = 0.4  # fraction of the frame time for which the shutter is open

CAMERA = Camera(SIZE, noise=2.0)

# heights, relative to the body height, at which the light on a person is evaluated
LIT = np.linspace(1.0, 0.0, 16)

SHADE = 0.85  # the target counts as shaded if the mean light on it is below this value


class WalkingScene(SyntheticScene):
    """Scene of people in a street, in a `kind` of light."""

    size = SIZE
    fps = FRAMES_PER_SECOND

    def __init__(self, plan: WalkPlan, kind: Light) -> None:
        self.plan, self.length = plan, len(plan)
        self._kind = kind
        self._still_pictures: dict[int, Image] = {}

    def truth(self) -> SceneTruth:
        target = self.plan.people[0]
        x, z = target.path.x[:, None], target.path.z[:, None]
        gains = self._street.gains(x, z, LIT * target.stature)
        return _truth(self.plan, gains.mean(axis=1) < SHADE)

    def render(self, frame: int) -> Image:
        plan, camera = self.plan, self.plan.views[frame]
        travel, (right, down) = plan.views.rate(frame)
        motion = right * EXPOSURE, down * EXPOSURE
        props = [*self._street.props, *plan.posts]
        things: list[tuple[float, Prop | int]] = [(prop.z, prop) for prop in props]
        things += [(plan.depth(person, frame), person) for person in plan.in_picture(frame)]
        ordered = [thing for _, thing in sorted(things, key=lambda item: -item[0])]
        # With a static camera, the image behind all people is equal in every frame.
        behind = next(
            (k for k, thing in enumerate(ordered) if isinstance(thing, int)), len(ordered)
        )
        if behind in self._still_pictures:
            canvas = self._still_pictures[behind].copy()
        else:
            canvas = np.empty((SIZE[1], SIZE[0], 3), np.uint8)
            self._street.draw(canvas, camera, motion, travel * EXPOSURE)
            for prop in ordered[:behind]:
                assert isinstance(prop, Prop)
                prop.draw(canvas, camera, motion[0], travel * EXPOSURE)
            if plan.views.stands_still:
                self._still_pictures[behind] = canvas.copy()
        for thing in ordered[behind:]:
            if isinstance(thing, int):
                self._draw_person(canvas, thing, frame)
            else:
                thing.draw(canvas, camera, motion[0], travel * EXPOSURE)
        return CAMERA.exposed(canvas, plan.seed, frame, self._exposure[frame])

    def mask(self, frame: int) -> Mask:
        return paste_window(SIZE, *self.plan.seen(frame)) >= 128

    def _draw_person(self, canvas: Image, person: int, frame: int) -> None:
        plan = self.plan
        x, y, height = plan.places[person, frame].tolist()
        motion = plan.motion(person, frame) * EXPOSURE
        plan.walkers[person].draw(
            canvas,
            x,
            y,
            height,
            plan.pose(person, frame),
            self._gains(person, frame),
            (float(motion[0]), float(motion[1])),
        )

    def _gains(self, person: int, frame: int) -> Array:
        """Return the light on a person from head to ground."""
        walker = self.plan.people[person]
        x, z = float(walker.path.x[frame]), float(walker.path.z[frame])
        return self._street.gains(x, z, LIT * walker.stature)

    @cached_property
    def _street(self) -> Street:
        return self.plan.street(self._kind)

    @cached_property
    def _exposure(self) -> Array:
        random = part_generator(self.plan.seed, "exposure")
        return slow_exposure(random, len(self))
