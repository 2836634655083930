"""Every tolerance of the suite, named for its reason; metres, radians and their rates."""

ORACLE = 1e-12
"""Poses and Jacobians against an independent double-precision library."""
ORACLE_RATES = 1e-10
"""Their time derivatives: longer sums of products, speeds of order 1."""
EXACT_CODE = 1e-13
"""Generated code against the same equations at 30 digits, for robots of a few metres."""
DERIVATIVES = 1e-12
"""Closed-form derivatives against automatic differentiation."""
PRINTED_9 = 5e-10
"""Reference numbers printed with nine decimals: half of the last."""
AGREEMENT = 1e-10
"""A peer's set-up in the benchmarks against ours: both must do the same work."""
LIBMVEC = 4
"""Units in the last place by which functions of glibc's vector library may be off: its promise."""
COS_SIN = 1.5
"""Units in the last place by which cosines and sines of lanes may be off, up to 1e5 radian."""
ANGLE = 2
"""Units in the last place by which the angle of a point may be off on lanes; 1.6 were seen."""
RECIPROCAL_ROOT = 2
"""Units in the last place by which 1 / sqrt(x) may be off on lanes; 1.5 were seen."""
NEAR_ROOT = 1e-11
"""Branches against 40 digits: near a vanishing root, a rounding error enters under the root."""
WORST_INVERSE = 5e-14
"""Residual of a solution of an inverse at a random pose: metres and radians."""
LIMIT = 0.012
"""Limits of joints in rad: data sheets give degrees, which descriptions round or widen by 0.7."""
