"""Generated and foreign C and C++, compiled into loops that Python times."""
