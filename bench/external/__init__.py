"""Trackers that run in processes of their own: other Python environments, other languages."""
