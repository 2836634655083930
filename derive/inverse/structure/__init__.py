"""How the axes of a chain lie to each other, and which closed form that allows."""
