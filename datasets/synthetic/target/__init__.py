"""A textured target on a textured ground, with one knob a difficulty."""

__all__: list[str] = []
