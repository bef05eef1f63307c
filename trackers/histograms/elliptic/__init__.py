"""Ellipses as states of a particle filter: how they move, where they start, what is background."""
