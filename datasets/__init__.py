"""Sequences: recorded ones behind readers, synthetic ones behind a renderer."""
