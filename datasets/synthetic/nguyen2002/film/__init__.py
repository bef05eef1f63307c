"""Clips of an action film: targets, occluders and six settings."""
