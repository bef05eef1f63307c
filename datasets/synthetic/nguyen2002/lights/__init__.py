"""Scene in which a hand moves a printed object in a room with two lamps."""
