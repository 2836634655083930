"""Benchmarks of speed and size, compared with other libraries (peers) in the same run."""
