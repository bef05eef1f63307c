"""Rendered sequences: a suite is a folder here; what suites share is in `render`."""
