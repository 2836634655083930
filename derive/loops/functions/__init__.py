"""Functions of loops: maps between actuators and main chain, and the loop equations."""
