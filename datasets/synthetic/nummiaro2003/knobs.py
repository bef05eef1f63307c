"""Knobs of the suite's sequences."""

from trackmark.datasets.synthetic.knobs import Knobs, Seed, seed


class WalkingKnobs(Knobs):
    """Knobs of a scene with people on foot."""

    scene: Seed = seed("all that is drawn at random: place, clothes, paths, camera")


class DrivingKnobs(Knobs):
    """Knobs of a scene with cars."""

    scene: Seed = seed("all that is drawn at random: place, cars, ways, camera")


class HeadKnobs(Knobs):
    """Knobs of `nummiaro2003/head`."""

    scene: Seed = seed("all that is drawn at random: worker, routine, machines")
