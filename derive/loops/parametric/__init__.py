"""Functions of coordinates q and geometry parameters p, for robots with loops."""
