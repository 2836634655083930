"""The program of a function: the statements that CasADi generates, and their improvement."""
