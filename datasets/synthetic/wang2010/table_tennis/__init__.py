"""Table tennis, from near: a hand bounces a ball on a bat before a wall."""
