"""The benchmarks: each module of this package exports `run(plan)`."""
