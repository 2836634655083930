"""Writes CUDA C++ with one thread per pose, in single and double precision."""
