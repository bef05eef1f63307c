"""Sequences with a driving car, recorded from a mast or from another car."""
