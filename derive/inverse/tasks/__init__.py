"""Tasks of an inverse, and the functions over all solutions that are generated for them."""
