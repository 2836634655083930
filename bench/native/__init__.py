"""C and C++ code that calls chasles and other libraries in loops, for timing."""
