"""An ellipse that changes its place, shape and colour at random before clutter."""

__all__: list[str] = []
