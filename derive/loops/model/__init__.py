"""Models of loops: bodies, frames and equations in exact, numerical and parametric form."""
