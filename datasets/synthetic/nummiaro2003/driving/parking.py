"""`nummiaro2003/car`: a car drives through a car park, recorded from a mast.

The paper shows "a person and a car in front of a parking place for the public PETS2001 dataset ...
the car sequence is especially interesting as scale changes and out-of-plane rotations have to be
handled" (section 7, Fig. 4). All other properties are our choice. The car approaches the camera on
one lane between parked cars, and crosses in front of the camera. It then drives away on a second
lane or parks at its side.
"""

from functools import lru_cache

import numpy as np
from numpy.random import Generator

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
    car_at,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.view import PerspectiveView, windows_meet
from trackmark.datasets.synthetic.nummiaro2003.driving.world import (
    House,
    Layout,
    StreetObject,
    Strip,
    broken_line,
    sample_house,
)
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.path import random_positions
from trackmark.datasets.synthetic.scene import part_generator

FRAMES = 400

LANES = 6.5  # distance of the two lanes of the car park from its middle [metres]
ROAD = 3.3  # half width of the road in front of the car park [metres]
BAY = 2.6  # width of a parking bay [metres]
ROWS = (-12.0, 0.0, 12.0)  # x of the rows of bays, outside and between the lanes [metres]
FIRST, LAST = 7.0, 41.0  # z at which the rows of bays start and end [metres]


def scene(parameters: SceneParameters) -> DrivingScene:
    """Return the scene, which gives the ground truth and renders frames on request."""
    return DrivingScene(parking_plan(parameters.scene), still=True)


@lru_cache(maxsize=4)
def parking_plan(seed: int) -> DrivingPlan:
    """Return surroundings, cars and camera of the scene with number `seed`."""

    def generator(part: str) -> Generator:
        return part_generator(seed, f"nummiaro2003/car {part}")

    side = 1.0 if generator("side").random() < 0.5 else -1.0
    view = _camera(generator("camera"), side)
    target = sample_car(generator("target"), TARGETS)
    other_paints = contrasting_paints(target.paint)
    path, bay = _sample_target_path(generator("target way"), side)
    passing = sample_car(generator("passing car"), other_paints)
    parked = _parked(generator("parked cars"), other_paints, bay)
    # The whole target is visible in the first frame, where trackers start.
    start = car_at(target, path, 0)
    parked = [car for car in parked if car.z > start.z or not _windows_overlap(car, start, view)]
    layout = Layout(
        int(generator("place").integers(2**32)),
        _strips(),
        _houses(generator("houses")),
        _plants(generator("plants")),
        parked,
    )
    cars = [(target, path), (passing, _sample_passing_path(generator("passing way")))]
    return DrivingPlan(layout, [view] * FRAMES, cars)


def _windows_overlap(first_car: CarAt, second_car: CarAt, view: PerspectiveView) -> bool:
    first, second = first_car.window(view), second_car.window(view)
    return first is not None and second is not None and windows_meet(first, second)


def _camera(random: Generator, side: float) -> PerspectiveView:
    """Sample a camera on a mast beyond the road, turned slightly towards the target's start."""
    x, z = side * random.uniform(-3.5, 1.0), -random.uniform(17.5, 19.0)
    aim = side * random.uniform(0.0, 1.0), random.uniform(8.0, 11.0)
    return PerspectiveView(
        focal=590.0,
        centre=(SIZE[0] / 2, SIZE[1] / 2),
        place=(x, random.uniform(5.6, 7.0), z),
        yaw=float(np.arctan2(aim[0] - x, aim[1] - z)),
        pitch=random.uniform(0.17, 0.2),
    )


def _sample_target_path(
    random: Generator, side: float
) -> tuple[DrivingPath, tuple[float, float] | None]:
    """Sample the target's path; return it with the bay (x, z) in which it parks, or None."""
    right = side > 0  # the car drives on the right in either direction
    inner = random.uniform(1.3, 1.7)
    x, back = side * LANES - inner, -side * LANES + inner
    z_cross = inner if right else -inner
    radius, start = random.uniform(4.3, 4.8), random.uniform(28.0, 33.0)
    across = abs(x - back) - 2 * radius
    turn = np.pi / 2 * side
    bends = [Bend(start - z_cross - radius, turn, radius), Bend(across, turn, radius)]
    bay = None
    if random.random() < 0.5:
        bends.append(Bend(random.uniform(20.0, 26.0) - radius))
        top, end = random.uniform(5.0, 6.0), 5.0
        frames = FRAMES
    else:
        into = 4.4
        up = FIRST + BAY * (random.integers(4, 7) + 0.5)
        outwards = -side  # the row on the outer side of the second lane
        bends += [
            Bend(up - z_cross - radius - into, outwards * np.pi / 2, into),
            Bend(3.0 + 2.4 + inner - into),
        ]
        bay = -side * ROWS[2], up
        top, end = random.uniform(5.0, 6.0), 0.3
        frames = FRAMES - int(random.integers(10, 30))
    route = Route(x, start, np.pi, bends)
    travelled = route.travelled(frames, top, end)
    stands = np.full(FRAMES - frames, travelled[-1])
    places = route.places_at(np.concatenate([travelled, stands]))
    return DrivingPath(*places.T), bay


def _sample_passing_path(random: Generator) -> DrivingPath:
    """Sample the path of a car on the near side of the road while the target is far away."""
    frame = int(random.integers(40, 80))
    speed = random.uniform(7.0, 9.0)
    x = (np.arange(FRAMES) - frame) * (speed / FRAMES_PER_SECOND)
    return DrivingPath.in_heading(FRAMES, x, -1.65, np.pi / 2)


def _parked(
    random: Generator, paints: tuple[BGR, ...], bay: tuple[float, float] | None
) -> list[CarAt]:
    cars = []
    for row in ROWS:
        for z in np.arange(FIRST + BAY / 2, LAST, BAY).tolist():
            car = sample_car(random, paints)
            x = row + random.uniform(-0.25, 0.25)
            heading = np.pi / 2 * random.choice([-1, 1]) + random.uniform(-0.03, 0.03)
            beside = bay is not None and -3.5 * BAY < z - bay[1] < 1.5 * BAY and x * bay[0] > 0
            if random.random() < 0.66 and not beside:
                cars.append(CarAt(car, x, z + random.uniform(-0.15, 0.15), heading))
    return cars


def _strips() -> list[Strip]:
    edge = LANES + 8.2
    lines = [
        Strip("paint", (row - 2.5, row + 2.5), (z - 0.05, z + 0.05))
        for row in ROWS
        for z in np.arange(FIRST, LAST + 0.1, BAY).tolist()
    ]
    mouths = [Strip("asphalt", (lane - 3.4, lane + 3.4), (ROAD, 5.4)) for lane in (-LANES, LANES)]
    give_way = [
        Strip("paint", (lane + a, lane + a + 0.6), (ROAD + 0.05, ROAD + 0.25))
        for lane in (-LANES, LANES)
        for a in np.arange(-3.0, 3.0, 0.9).tolist()
    ]
    return [
        *lines,
        *give_way,
        *broken_line(-90.0, 90.0, 0.0, along_x=True),
        *mouths,
        Strip("asphalt", (-edge, edge), (5.4, LAST + 7.0)),
        Strip("asphalt", (-200.0, 200.0), (-ROAD, ROAD)),
        Strip("kerb", (-200.0, 200.0), (-ROAD - 0.2, ROAD + 0.2)),
        Strip("kerb", (-edge - 0.2, edge + 0.2), (5.2, LAST + 7.2)),
        Strip("paving", (-200.0, 200.0), (ROAD, 5.2)),
        Strip("paving", (-200.0, 200.0), (-5.2, -ROAD)),
        Strip("grass", (-4000.0, 4000.0), (-100.0, 4000.0)),
    ]


def _houses(random: Generator) -> list[House]:
    """Sample offices and houses behind the car park, and houses on either side of it."""
    houses = []
    x = -46.0
    while x < 46:
        wide = random.uniform(16, 34)
        depth = random.uniform(10, 14)
        large = bool(random.random() < 0.7)
        houses.append(sample_house(random, x + wide / 2, LAST + 16 + depth / 2, wide, depth, large))
        x += wide + random.uniform(2, 10)
    for side in (-1, 1):
        for z in (14.0, 34.0):
            wide = random.uniform(10, 14)
            houses.append(sample_house(random, side * random.uniform(32, 36), z, wide, 12.0))
    return houses


def _plants(random: Generator) -> list[StreetObject]:
    plants = []
    for side in (-1, 1):
        for z in random_positions(random, 8.0, LAST + 4, (4, 10)):
            kind = "tree" if random.random() < 0.7 else "bush"
            plants.append(StreetObject(kind, side * (LANES + 9.6), z, random.uniform(0.8, 1.15)))
    for x in random_positions(random, -40.0, 40, (4, 9)):
        kind = ("tree", "tree", "bush", "post")[random.integers(4)]
        plants.append(
            StreetObject(kind, x, LAST + 10 + random.uniform(0, 3), random.uniform(0.8, 1.2))
        )
    return plants
