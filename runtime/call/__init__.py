"""Calls into C: arguments, results, threads and arrays of other libraries."""
