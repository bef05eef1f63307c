"""The reproduction of Nguyen & Smeulders 2002."""
