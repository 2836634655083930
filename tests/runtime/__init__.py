"""The runtime: calls, the cache of compiled libraries, robots."""
