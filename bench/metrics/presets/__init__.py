"""Metrics presets, a file each, found by their names."""
