"""A leaf that the wind moves before others, while the sun comes or goes."""

__all__: list[str] = []
