"""Plans of the eight sequences: target, other people, camera and posts."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

from numpy.random import Generator

from trackmark.datasets.synthetic.multipart import casting, routes
from trackmark.datasets.synthetic.multipart.designs import DESIGNS, Design
from trackmark.datasets.synthetic.multipart.plan import Person, Post, WalkPlan
from trackmark.datasets.synthetic.render.views import (
    Views,
    WalkingPath,
    sample_fixed_views,
    sample_following_views,
)
from trackmark.datasets.synthetic.scene import part_generator

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
def multipart_plan(number: str, scene: int, thickness: tuple[float, float] = POSTS) -> WalkPlan:
    """Return the plan of a sequence; `thickness` is the range of its posts' thickness [metres]."""
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
    people = [target, *_resembling(generator, design, views, target, others)]
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


def _resembling(
    generator: Generators, design: Design, views: Views, target: Person, others: list[WalkingPath]
) -> list[Person]:
    """Return people in the target's colours: some in stripes overtake it, one person crosses."""
    people = []
    for i in range(design.mixed):
        random = generator(f"mixed {i}")
        meeting_frame = (i + random.uniform(0.4, 0.6)) / design.mixed * design.length
        others.append(
            routes.sample_overtaking_path(
                random, views, target.path, others, meeting_frame, design.pace
            )
        )
        look = casting.stripe_clothes(target.look)
        people.append(Person(look, casting.sample_seed(random), 1.06 * target.stature, others[-1]))
    if design.crossing:
        random = generator("crossing")
        others.append(routes.sample_crossing_path(random, views, target.path, others, CROSSING))
        people.append(Person(target.look, casting.sample_seed(random), target.stature, others[-1]))
    return people


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
        clothes = casting.sample_passer_clothes(random, (target.look.shirt, target.look.trousers))
        people.append(casting.sample_person(random, path, clothes))
    return people
