"""The benchmarks: each module exports `run(plan)`."""
