"""Metrics presets, one per module."""
