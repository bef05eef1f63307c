"""A room in which a hand moves, in front of somebody's face."""
