"""Parameters of the suite's sequences."""

from trackmark.datasets.synthetic.parameters import Seed, SequenceParameters, seed


class FilmParameters(SequenceParameters):
    """Parameters of `nguyen2002/clip-01` to `clip-20`."""

    scene: Seed = seed("a set of 20 clips: settings, targets, occluders, paths, grain")


class LightsParameters(SequenceParameters):
    """Parameters of `nguyen2002/lights`."""

    scene: Seed = seed("object, path, occluders, room, noise")
