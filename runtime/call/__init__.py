"""Calls of compiled functions: arguments, results, threads and foreign arrays."""
