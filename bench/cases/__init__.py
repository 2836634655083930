"""Arms and robots of the benchmarks, their poses, and the tasks of their inverses."""
