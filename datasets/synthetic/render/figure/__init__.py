"""Person at close range: a textured mesh on bones, and a routine of movements."""
