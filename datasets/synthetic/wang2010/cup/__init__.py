"""A kitchen: a cup that a hand carries past things of nearly its colour."""
