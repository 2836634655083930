"""C and C++ of chasles and other libraries, compiled into loops for timing."""
