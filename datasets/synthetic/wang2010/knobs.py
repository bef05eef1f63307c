"""Options of the suite's sequences."""

from trackmark.datasets.synthetic.knobs import Knobs, Seed, seed


class TableTennisKnobs(Knobs):
    """Options of `wang2010/table-tennis`."""

    scene: Seed = seed("all that is drawn at random: wall, player, light, motion, noise")


class HandKnobs(Knobs):
    """Options of `wang2010/hand`."""

    scene: Seed = seed("all that is drawn at random: person, room, hand, way, noise")


class CupKnobs(Knobs):
    """Options of `wang2010/cup`."""

    scene: Seed = seed("all that is drawn at random: cup, hand, way, kitchen, noise")
