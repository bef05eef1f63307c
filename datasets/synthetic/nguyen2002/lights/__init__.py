"""Room with two lamps in which a hand moves a printed object."""
