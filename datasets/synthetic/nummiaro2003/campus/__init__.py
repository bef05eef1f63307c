"""Sequences with a pedestrian in front of a car park and a student on a campus."""
