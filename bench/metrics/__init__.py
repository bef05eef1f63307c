"""Scores of boxes against truth: arrays in, numbers out. Truth is always the first argument."""
