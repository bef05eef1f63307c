"""`nummiaro2003/traffic`: a car, recorded from the car that follows it.

The paper describes "a driver assistance application, where the color-based particle filter has to
handle rapid movements of the target and the camera ... Different viewing angles of the tracked car
make the experiment quite difficult", with "large scale changes and out-of-plane rotations" (section
7, Fig. 8 and 9). All other properties are our choice. The target slows down and turns into a side
road after 12 to 18 metres. The car with the camera approaches it, follows it, and falls back.

The paper updates the target model "to overcome the resulting appearance changes" (section 5). In
the even light of an overcast sky, the rear of a car has the same colours before and after a turn.
The sky is therefore hazy, and brighter on the side of a low sun. At first the target shows its
shaded rear, then a side, and after the turn its bright rear. Haze scatters the light, so there are
no sharp shadows.
"""

from functools import lru_cache

import numpy as np
from numpy.random import Generator

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.nummiaro2003.driving import world
from trackmark.datasets.synthetic.nummiaro2003.driving.car import (
    BGR,
    TARGETS,
    CarAt,
    contrasting_paints,
    sample_car,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.scene import (
    FRAMES_PER_SECOND,
    SIZE,
    Bend,
    DrivingPath,
    DrivingPlan,
    DrivingScene,
    Route,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.view import OVERCAST, Light, PerspectiveView
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.path import random_positions, smooth_step
from trackmark.datasets.synthetic.render.views import QUICK, SLOW, random_wander
from trackmark.datasets.synthetic.scene import part_generator

FRAMES = 330

LANE = 1.75  # distance of the middle of a lane from the middle of the road [metres]
EDGE = 4.4  # half width of a road [metres]
PAVED = 7.2  # outer edge of the pavement, from the road's middle [metres]
ROOM = 0.24  # maximum angle of the target from the optical axis [radians]
# distance that the target drives before it turns, so that most frames show changed colours [metres]
STRAIGHT = 12.0, 18.0
SUN = 0.55  # difference between the light on an upright facet that faces the sun and the mean light
# minimum and maximum angle between the sun and the first direction of travel, on the side away from
# the turn [degrees]: the sun is outside the image, and the rear faces it after the turn
AZIMUTH = 35.0, 60.0
# Angle of the target from the optical axis, relative to its angle from the axis of the car with
# the camera, for small angles: the camera turns towards the target by the remaining angle.
FREE = 0.2


def scene(parameters: SceneParameters) -> DrivingScene:
    """Return the scene, which gives the ground truth and renders frames on request."""
    return DrivingScene(traffic_plan(parameters.scene), still=False)


@lru_cache(maxsize=4)
def traffic_plan(seed: int) -> DrivingPlan:
    """Return surroundings, cars and camera of the scene with number `seed`."""

    def generator(part: str) -> Generator:
        return part_generator(seed, f"nummiaro2003/traffic {part}")

    target = sample_car(generator("target"), TARGETS)
    other_paints = contrasting_paints(target.paint)
    path, follower, crossing = _sample_paths(generator("ways"))
    views = _views(generator("camera"), path, follower)
    light = _sample_light(generator("sun"), path)
    layout = world.Layout(
        int(generator("place").integers(2**32)),
        _strips(crossing),
        _houses(generator("houses"), crossing),
        _plants(generator("plants"), crossing),
        _parked(generator("parked cars"), other_paints, crossing, light),
        light,
    )
    cars = [(target, path)]
    for i, route in enumerate(_oncoming(generator("oncoming ways"), path, crossing)):
        cars.append((sample_car(generator(f"oncoming car {i}"), other_paints), route))
    return DrivingPlan(layout, views, cars)


def _sample_light(random: Generator, target: DrivingPath) -> Light:
    """Sample the light of a low sun in haze: the target's rear turns from shade into light."""
    azimuth = np.radians(random.uniform(*AZIMUTH))
    side = np.sign(target.heading[0] - target.heading[-1])
    up, constant = OVERCAST[1], OVERCAST[3]
    return float(SUN * side * np.sin(azimuth)), up, float(SUN * np.cos(azimuth)), constant


def _sample_paths(random: Generator) -> tuple[DrivingPath, DrivingPath, float]:
    """Return the paths of the target and of the follower, and the z of the crossing [metres].

    Both cars follow the same route. The distance between them determines the target's size.
    """
    gap, least = random.uniform(24.0, 26.5), random.uniform(16.0, 18.0)
    right = random.random() < 0.5
    radius = random.uniform(7.5, 8.5) if right else random.uniform(8.0, 9.0)
    turn = np.pi / 2 if right else -np.pi / 2
    straight = gap + random.uniform(*STRAIGHT)
    route = Route(LANE, 0.0, 0.0, [Bend(straight, turn, radius), Bend(140.0)])
    top = random.uniform(10.0, 11.0)
    crossing = straight + radius + (LANE if right else -LANE)
    ahead = route.driven(FRAMES, gap, top)
    # The target is nearest in the middle of the bend.
    middle = float(np.interp(straight + abs(turn) * radius / 2, ahead, np.arange(FRAMES)))
    time = np.arange(FRAMES, dtype=np.float64)
    closing = smooth_step(time, 10.0, middle)
    leaving = smooth_step(time, middle + 15.0, FRAMES - 10.0)
    last = random.uniform(24.0, 27.0)
    # Interpolated in the logarithm, so that the size changes by similar factors per frame.
    distance = gap * (least / gap) ** closing * (last / least) ** leaving
    sway = random_wander(random, FRAMES, (3.0, 7.0), 0.16)
    paths = [
        _swaying_path(route.places_at(s), sway * k)
        for s, k in ((ahead, 1.0), (ahead - distance, 0.4))
    ]
    return paths[0], paths[1], crossing


def _swaying_path(places: Array, sway: Array) -> DrivingPath:
    """Return the path along `places` (x, z, heading), shifted sideways by `sway` [metres]."""
    x, z, heading = places.T
    x, z = x + sway * np.cos(heading), z - sway * np.sin(heading)
    step = np.maximum(np.sqrt(np.gradient(x) ** 2 + np.gradient(z) ** 2), 0.05)
    return DrivingPath(x, z, heading + np.arctan2(np.gradient(sway), step))


def _views(random: Generator, target: DrivingPath, follower: DrivingPath) -> list[PerspectiveView]:
    """Return the camera behind the windscreen: it shakes, and it turns towards the target.

    The turn keeps the target within the angle ROOM of the optical axis.
    """
    eye = 0.4  # ahead of the car's middle [metres]
    x = follower.x + eye * np.sin(follower.heading)
    z = follower.z + eye * np.cos(follower.heading)
    height = random.uniform(1.3, 1.45)
    bearing = np.unwrap(np.arctan2(target.x - x, target.z - z))
    off = bearing - follower.heading
    wander = random_wander(random, FRAMES, SLOW, 0.05)
    yaw = bearing - ROOM * np.tanh((FREE * off + wander) / ROOM)
    yaw += random_wander(random, FRAMES, QUICK, 0.004)
    pitch = random.uniform(0.015, 0.045) + random_wander(random, FRAMES, SLOW, 0.008)
    pitch += random_wander(random, FRAMES, QUICK, 0.004)
    for frame in random.choice(np.arange(20, FRAMES - 20, 15), 5, replace=False):  # potholes
        time = np.arange(FRAMES) - frame
        hit = np.exp(-np.maximum(time, 0) / 6.0) * np.sin(time * 1.3) * (time >= 0)
        pitch += random.uniform(0.008, 0.014) * hit
    return [
        PerspectiveView(
            560.0, (SIZE[0] / 2, SIZE[1] / 2), (float(a), height, float(b)), float(c), float(d)
        )
        for a, b, c, d in zip(x, z, yaw, pitch, strict=True)
    ]


def _oncoming(random: Generator, target: DrivingPath, crossing: float) -> list[DrivingPath]:
    """Return paths of oncoming cars; none is at the crossing while the target turns."""
    enters = int(np.searchsorted(target.z, crossing - 3 * EDGE))
    paths = []
    for earlier in (random.uniform(60, 80), random.uniform(110, 150)):
        step = random.uniform(9.0, 12.0) / FRAMES_PER_SECOND
        z = crossing + (enters - earlier - np.arange(FRAMES)) * step
        paths.append(DrivingPath.in_heading(FRAMES, -LANE, z, np.pi))
    # One more car, which the follower meets in the side road.
    side = float(np.sign(target.x[-1] - target.x[0]))
    away = FRAMES + random.uniform(20, 60) - np.arange(FRAMES)
    x = side * away * (random.uniform(9.0, 11.0) / FRAMES_PER_SECOND)
    paths.append(DrivingPath.in_heading(FRAMES, x, crossing + side * LANE, -side * np.pi / 2))
    return paths


def _strips(crossing: float) -> list[world.Strip]:
    near, far = -60.0, 900.0
    open_to = crossing - EDGE, crossing + EDGE
    return [
        *world.broken_line(near, open_to[0] - 3, 0.0, along_x=False),
        *world.broken_line(open_to[1] + 1, crossing + 150.0, 0.0, along_x=False),
        *(
            strip
            for side in (-1, 1)
            for start in np.arange(EDGE + 1.5, 240.0, 9.0).tolist()
            for strip in world.broken_line(
                min(side * start, side * (start + 3.0)),
                min(side * start, side * (start + 3.0)) + 0.1,
                crossing,
                along_x=True,
            )
        ),
        *(
            world.Strip("paint", (min(side * (EDGE + 0.3), side * (EDGE + 0.6)),
                          max(side * (EDGE + 0.3), side * (EDGE + 0.6))),
                  (crossing + lane - 1.6, crossing + lane + 1.6))
            for side, lane in ((1, LANE), (-1, -LANE))
        ),
        world.Strip("asphalt", (-EDGE, EDGE), (near, far)),
        world.Strip("asphalt", (-260.0, 260.0), open_to),
        world.Strip("kerb", (-EDGE - 0.2, EDGE + 0.2), (near, far)),
        world.Strip("kerb", (-260.0, 260.0), (open_to[0] - 0.2, open_to[1] + 0.2)),
        world.Strip("paving", (-PAVED, PAVED), (near, far)),
        world.Strip("paving", (-260.0, 260.0), (crossing - PAVED, crossing + PAVED)),
        world.Strip("grass", (-4000.0, 4000.0), (-4000.0, 4000.0)),
    ]  # fmt: skip


def _houses(random: Generator, crossing: float) -> list[world.House]:
    """Sample houses along both roads. None is near the crossing, where it would block the view."""
    houses = []
    for side in (-1, 1):
        z = -10.0 + random.uniform(0, 8)
        while z < crossing + 90:
            wide, depth = random.uniform(10, 18), random.uniform(9, 13)
            if abs(z + wide / 2 - crossing) > 26 + wide / 2:
                x = side * (random.uniform(12.5, 16.0) + depth / 2)
                houses.append(world.sample_house(random, x, z + wide / 2, depth, wide))
            z += wide + random.uniform(3, 9)
        for across in (-1, 1):
            x = random.uniform(26, 32)
            while x < 170:
                wide, depth = random.uniform(10, 18), random.uniform(9, 13)
                z = crossing + across * (random.uniform(12.5, 16.0) + depth / 2)
                houses.append(world.sample_house(random, side * (x + wide / 2), z, wide, depth))
                x += wide + random.uniform(3, 9)
    return houses


def _plants(random: Generator, crossing: float) -> list[world.StreetObject]:
    plants = []
    kinds = ("tree", "tree", "tree", "post", "bush", "sign")
    for side in (-1, 1):
        for z in random_positions(random, random.uniform(5, 12), crossing + 80, (9, 17)):
            if abs(z - crossing) > PAVED + 2:
                x = side * (PAVED + random.uniform(1.2, 2.8))
                plants.append(
                    world.StreetObject(kinds[random.integers(6)], x, z, random.uniform(0.8, 1.2))
                )
        for across in (-1, 1):
            for x in random_positions(random, PAVED + random.uniform(4, 10), 160, (9, 17)):
                z = crossing + across * (PAVED + random.uniform(1.2, 2.8))
                plants.append(
                    world.StreetObject(
                        kinds[random.integers(6)], side * x, z, random.uniform(0.8, 1.2)
                    )
                )
    return plants


def _parked(
    random: Generator, paints: tuple[BGR, ...], crossing: float, light: Light
) -> list[CarAt]:
    """Sample cars along the kerbs of both roads; they stand with two wheels on the pavement."""
    cars = []
    kerb = EDGE + 0.15
    for side in (-1, 1):
        for z in random_positions(random, random.uniform(8, 20), crossing + 60, (7, 13)):
            car = sample_car(random, paints)
            heading = 0.0 if side > 0 else np.pi
            if abs(z - crossing) > 16 and random.random() < 0.45:
                cars.append(CarAt(car, side * kerb, z, heading, light))
        for across in (-1, 1):
            for x in random_positions(random, random.uniform(20, 30), 140, (8, 14)):
                car = sample_car(random, paints)
                heading = np.pi / 2 if across < 0 else -np.pi / 2
                if random.random() < 0.4:
                    cars.append(CarAt(car, side * x, crossing + across * kerb, heading, light))
    return cars
