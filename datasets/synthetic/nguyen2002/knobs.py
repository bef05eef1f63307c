"""Knobs of the suite's sequences."""

from trackmark.datasets.synthetic.knobs import Knobs, Seed, seed


class FilmKnobs(Knobs):
    """Knobs of `nguyen2002/clip-01` to `clip-20`."""

    scene: Seed = seed("a set of 20 clips: settings, targets, what hides them, ways, grain")


class LightsKnobs(Knobs):
    """Knobs of `nguyen2002/lights`."""

    scene: Seed = seed("all that is drawn at random: object, way, occluders, room, noise")
