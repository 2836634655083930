"""Solution steps shared by several families, and the record of the solution."""
