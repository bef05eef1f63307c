"""Street: houses, ground, static objects and light."""
