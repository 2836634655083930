"""Solution steps that several families of arms share, and the record of the solution."""
