"""Clothed persons who walk: bodies as bands of cloth, textures wrapped around them."""

__all__: list[str] = []
