"""Stored results: requested runs, runs with their scores, and ground truth."""
