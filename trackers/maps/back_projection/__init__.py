"""Colour back-projection: how much each pixel's colour belongs to the target."""
