"""Parameters of the suite's sequences."""

from trackmark.datasets.synthetic.knobs import Knobs, Seed, seed


class FilmKnobs(Knobs):
    """Parameters of `nguyen2002/clip-01` to `clip-20`."""

    scene: Seed = seed("a set of 20 clips: settings, targets, occluders, paths, grain")


class LightsKnobs(Knobs):
    """Parameters of `nguyen2002/lights`."""

    scene: Seed = seed("object, path, occluders, room, noise")
