"""Parameters of the suite's sequences."""

from trackmark.datasets.synthetic.knobs import Knobs, Seed, seed


class EllipseKnobs(Knobs):
    """Parameters of `moreno2005/ellipse`."""

    scene: Seed = seed("trajectory, shape, colours, clutter and noise")


class OctopusKnobs(Knobs):
    """Parameters of `moreno2005/octopus`."""

    scene: Seed = seed("animal, trajectory, floor, light and noise")


class BookKnobs(Knobs):
    """Parameters of `moreno2005/book`."""

    scene: Seed = seed("book, bending, trajectory, room and noise")


class LeafKnobs(Knobs):
    """Parameters of `moreno2005/leaf`."""

    scene: Seed = seed("leaf, wind, foliage, sun and noise")
