import numpy as np

DAMPING_THRESHOLD: float
"""The singular value below which a direction is damped unless the caller says otherwise."""
bounds: np.ufunc
"""q, lower, upper, rate limit, acceleration limit, previous rate (..., n), dt (...)
-> least and greatest rate (..., n)."""
solve: np.ufunc
"""J (..., 6, n), V (..., 6), lower, upper, null-space rates, unit (..., n), row (..., 6), border,
rank (...) -> rates (..., n), twist (..., 6), damping, smallest singular value (...), its direction
(..., 6), scale (...), limited (..., n)."""
gradient: np.ufunc
"""J (..., 6, n), H (..., 6, n, n), unit (..., n), row (..., 6), rank (...)
-> measure (...), its gradient (..., n)."""
