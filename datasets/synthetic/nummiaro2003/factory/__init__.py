"""A worker in a factory: his head, close up, before machines."""
