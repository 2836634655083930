"""Models loops: bodies, ends and equations in exact, numerical and parametric form."""
