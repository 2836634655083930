"""A module of JAX functions that run on every device, with derivatives by JAX."""
