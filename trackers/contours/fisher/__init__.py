"""Colours seen on a Fisher plane: its discriminant axes, mixtures and posteriors on it."""
