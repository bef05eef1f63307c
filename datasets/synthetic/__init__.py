"""Synthetic sequences: each suite is a folder; `render` contains common components."""
