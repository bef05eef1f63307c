"""Clips that imitate an action film: targets, occluders and six settings."""
