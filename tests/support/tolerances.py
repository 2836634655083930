"""The tolerances of the test suite, in meter, radian and the corresponding velocities."""

ORACLE = 1e-12
"""Tolerance for poses and Jacobians that are compared with an independent double-precision
library."""
ORACLE_RATES = 1e-10
"""Tolerance for time derivatives of poses and Jacobians at joint rates of about 1.

A time derivative is a longer sum of products than a pose or Jacobian.
"""
EXACT_CODE = 1e-13
"""Tolerance for generated code that is compared with a 30-digit evaluation of its equations, for
robots of a few meters."""
DERIVATIVES = 1e-12
"""Tolerance for closed-form derivatives that are compared with automatic differentiation."""
PRINTED_9 = 5e-10
"""Tolerance for reference values printed with nine decimal places: half a unit in the last
place."""
AGREEMENT = 1e-10
"""Maximum difference between results of chasles and of another library for the same task."""
LIBMVEC = 4
"""Maximum error (units in the last place) of the glibc vector library, as documented."""
COS_SIN = 1.5
"""Maximum error (units in the last place) of SIMD cosines and sines, up to 1e5 radian."""
ANGLE = 2
"""Maximum error (units in the last place) of atan2 in SIMD code; 1.6 was observed."""
RECIPROCAL_ROOT = 2
"""Maximum error (units in the last place) of 1 / sqrt(x) in SIMD code; 1.5 was observed."""
NEAR_ROOT = 1e-11
"""Tolerance for the comparison of branches with results in 40-digit arithmetic. Near a root that is
zero, rounding errors are amplified."""
WORST_INVERSE = 5e-14
"""Maximum residual of an inverse solution at a random pose (meter, radian)."""
LIMIT = 0.012
"""Tolerance for joint limits (radian)."""
