"""Benchmarks of speed and size, compared with other libraries in the same run."""
