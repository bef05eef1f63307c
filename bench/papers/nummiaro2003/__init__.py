"""The adaptive elliptic colour particle filter: Fig. 2 to 10, and what the text claims of it."""
