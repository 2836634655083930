"""C and C++ of chasles and its peers, compiled into loops for timing."""
