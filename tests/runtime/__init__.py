"""Tests of the runtime: function calls, the cache of compiled libraries, and loaded robots."""
