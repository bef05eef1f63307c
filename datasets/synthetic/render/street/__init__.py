"""Components of a street: houses, ground, static objects and light."""
