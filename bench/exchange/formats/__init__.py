"""Layouts of results, a file each."""
