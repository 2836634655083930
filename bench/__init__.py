"""Benchmarks of speed and size, always compared with a peer measured in the same run."""
