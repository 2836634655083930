"""Solution steps that several families share, and the record of the solution."""
