"""Rendered sequences: a suite is a file here; what suites share is in `engine`."""

__all__: list[str] = []
