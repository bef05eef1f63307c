"""People who walk in a street, before a following or a fixed camera."""

__all__: list[str] = []
