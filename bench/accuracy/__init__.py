"""Counts of missed, wrong and lost solutions, judged independently of the generated code."""
