"""Typed programs of functions: the statements that CasADi generates, and optimizations."""
