/* Finds solutions near fold points, where two solution branches meet. This file is part of chasles
 * and is the same for every robot. The header chasles_polish.h includes this file once for each
 * robot.
 *
 * For a nearly singular Jacobian, v is the joint direction with the smallest pose change, and u is
 * the twist direction that the joints can hardly reach. The pose error is the twist from the tool
 * pose at the displaced configuration q + s v to the target pose. The component of the pose error
 * along u is the quadratic polynomial e(s) = lack - slope s - bend s^2 / 2. The quadratic e(s) has
 * two real roots, one on each side of the fold point, if the discriminant slope^2 + 2 bend lack is
 * positive. If the discriminant of e(s) is negative, e(s) has no real root. The two real roots of
 * e(s) give start configurations for two branches of the true arm, even if the nominal arm has no
 * solution. */
/* Data of the fold points that the SIMD lanes process, one fold point per lane. `c` is a
 * configuration near the fold point, and `along` is the joint direction v with the smallest pose
 * change. `lack`, the constant coefficient of the quadratic e(s), is not negative. `step` is the
 * Newton step orthogonal to the joint direction v, and `step2` is its squared length. */
typedef struct {
    POLISH_NAME(configurations) c;
    lanes along[POLISH_N], u[6], lack, slope, bend, step[POLISH_N], step2;
} POLISH_NAME(folds);

/* Computes the nearly singular directions v (joints) and u (twist) at the configurations, and the
 * Newton step orthogonal to v. */
POLISH_INLINE void POLISH_NAME(weakest)(const double *T, POLISH_NAME(folds) * f)
{
    const lanes added = POLISH_OF(POLISH_MIN_DAMPING);
    lanes J[6][POLISH_N], a[6][6], b[1][6], pivots[2] = {POLISH_OF(1.0), POLISH_OF(1.0)};
    lanes size = POLISH_OF(0.0), lack = size, slope2 = POLISH_OF(1e-30), along = size;
    POLISH_NAME(evaluate)(T, &f->c);
    POLISH_NAME(weighted)(&f->c, J);
    POLISH_NAME(squared)(J, &added, a);
    for (int i = 0; i < 6; i++)
        b[0][i] = POLISH_OF(1.0 - 0.3 * i);
    POLISH_NAME(solve)(a, b, 1, pivots);
    POLISH_NAME(solve_again)(a, b[0]);
    for (int i = 0; i < 6; i++) {
        size += b[0][i] * b[0][i];
        lack += b[0][i] * f->c.e[i];
    }
    POLISH_RSQRT(unit, size);
    const lanes sign = LANES_CHOICE(LANES_LT(lack, POLISH_OF(0.0)), -unit, unit);
    f->lack = lack * sign;
    for (int i = 0; i < 6; i++) {
        f->u[i] = b[0][i] * sign;
        b[0][i] = f->c.e[i] - f->lack * f->u[i];
    }
    POLISH_NAME(solve_again)(a, b[0]);
    for (int k = 0; k < POLISH_N; k++) {
        f->along[k] = f->step[k] = POLISH_OF(0.0);
        POLISH_UNROLL
        for (int i = 0; i < 6; i++) {
            f->along[k] += J[i][k] * f->u[i];
            f->step[k] += J[i][k] * b[0][i];
        }
        slope2 += f->along[k] * f->along[k];
    }
    POLISH_RSQRT(inverse, slope2);
    f->slope = slope2 * inverse;
    for (int k = 0; k < POLISH_N; k++) {
        f->along[k] *= inverse;
        along += f->along[k] * f->step[k];
    }
    f->step2 = POLISH_OF(0.0);
    for (int k = 0; k < POLISH_N; k++) {
        f->step[k] -= along * f->along[k];
        f->step2 += f->step[k] * f->step[k];
    }
}

/* Moves each configuration by the Newton step orthogonal to v, and recomputes the nearly singular
 * directions v (joints) and u (twist) there. Computes `bend`, the curvature at the fold point, from
 * the Jacobian at a configuration displaced along the joint direction v. */
static LANES_TARGET void POLISH_NAME(bent)(const double *T, POLISH_NAME(folds) * f)
{
    POLISH_NAME(configurations) shifted;
    lanes J[6][POLISH_N], moved = POLISH_OF(0.0);
    POLISH_NAME(weakest)(T, f);
    const lanes first2 = f->step2;
    POLISH_NAME(move)(f->c.q, f->step, f->c.q);
    POLISH_NAME(weakest)(T, f);
    f->step2 = POLISH_MAX(f->step2, POLISH_SQUARED * first2);
    for (int k = 0; k < POLISH_N; k++)
        shifted.q[k] = f->c.q[k] + POLISH_BEND_OFFSET * f->along[k];
    POLISH_NAME(evaluate)(T, &shifted);
    POLISH_NAME(weighted)(&shifted, J);
    for (int k = 0; k < POLISH_N; k++) {
        POLISH_UNROLL
        for (int i = 0; i < 6; i++)
            moved += f->u[i] * J[i][k] * f->along[k];
    }
    f->bend = (moved - f->slope) * (1.0 / POLISH_BEND_OFFSET);
}

/* Pairs of solution branches that meet at a fold point. `q` contains a start configuration for each
 * branch of a pair, and `far2` is the squared half distance between the two start configurations.
 */
typedef struct {
    int count;
    double q[POLISH_SLOTS][2][POLISH_N], far2[POLISH_SLOTS];
} POLISH_NAME(pairs);

/* Returns whether a known solution is near a configuration. */
static int POLISH_NAME(is_known)(const POLISH_NAME(search) * s, const double *q, double far2)
{
    for (int k = 0; k < POLISH_RESULTS; k++) {
        if (s->taken[k] && POLISH_NAME(apart2)(q, s->q + POLISH_N * k) < far2)
            return 1;
    }
    return 0;
}

/* Returns whether a solution branch without a known solution may end at a fold point. The branch
 * may end at a fold point if the nominal arm reaches the pose or narrowly misses it. */
static int POLISH_NAME(is_folded)(double residual, double pivot)
{
    if (residual < POLISH_REACH)
        return 1;
    const double near = POLISH_NEARER * POLISH_DEVIATION;
    const double moved = POLISH_AMPLIFIED * POLISH_DEVIATION;
    if (residual < POLISH_DEVIATIONS(10.0) && pivot < near * near)
        return 1;
    return residual < POLISH_FARTHEST && pivot < POLISH_SECOND * POLISH_SECOND &&
           pivot * residual * residual < moved * moved;
}

/* Returns whether solutions may exist away from a fold point of the nominal arm. At its
 * configuration nearest to the pose, the nominal arm must be singular, with a pose error that is
 * hardly along the unreachable twist direction u. The argument `cost` is the squared pose error
 * (radian, or relative to the arm length). */
static int POLISH_NAME(is_aside)(double cost, double pivot, double step2)
{
    const double unsure = POLISH_UNSURE * POLISH_DEVIATION;
    return pivot < unsure * unsure && step2 * pivot < POLISH_ASIDE * cost;
}

/* Returns whether further solutions may be near a branch that already has a known solution. */
static int POLISH_NAME(is_swerved)(double first2, double trace)
{
    const double part = POLISH_DEVIATION * trace;
    return part * part * trace * first2 > POLISH_SWERVED * POLISH_SWERVED;
}

/* Queues a start of Newton's iteration on each side of the fold points, unless the solution there
 * is known. Returns 1 if the number of solutions at each fold point is known to be zero or two,
 * otherwise 0. */
static LANES_TARGET int POLISH_NAME(part)(POLISH_NAME(search) * s, const POLISH_NAME(slots) * start,
                                          POLISH_NAME(folds) * f, const int *slot, int count,
                                          POLISH_NAME(pairs) * pairs)
{
    int is_clear = 1;
    POLISH_NAME(repeat)((double *)f->c.q, POLISH_N, count);
    POLISH_NAME(bent)(s->in, f);
    for (int lane = 0; lane < count; lane++) {
        const double slope = ((double *)&f->slope)[lane], bend = ((double *)&f->bend)[lane];
        const double of_lack = 2.0 * bend * ((double *)&f->lack)[lane], of_slope = slope * slope;
        const double square = of_slope + of_lack, step2 = ((double *)&f->step2)[lane];
        const double most = fabs(of_lack) > of_slope ? fabs(of_lack) : of_slope;
        const double longest = POLISH_LONGEST * bend;
        const int is_flat = !(fabs(bend) > POLISH_FLAT * POLISH_DEVIATION) ||
                            (square < 0.0 && fabs(bend) < POLISH_FLAT_MISSED * POLISH_DEVIATION &&
                             of_slope > POLISH_TILTED * fabs(of_lack));
        is_clear = is_clear && !is_flat && (square > 0.0 ? most : of_slope) < longest * longest &&
                   step2 < POLISH_SIDEWAYS * POLISH_SIDEWAYS &&
                   fabs(square) > POLISH_CLEAR * (most + step2);
        if (!(square > 0.0))
            continue;
        const double *q = (double *)f->c.q + lane, *along = (double *)f->along + lane;
        const double root = sqrt(square), far2 = square / (bend * bend);
        pairs->far2[pairs->count] = far2;
        for (int side = 0; side < 2; side++) {
            double *place = pairs->q[pairs->count][side];
            const double step = ((side ? root : -root) - slope) / bend;
            for (int i = 0; i < POLISH_N; i++)
                place[i] = q[LANES * i] + step * along[LANES * i];
            if (!POLISH_NAME(is_known)(s, place, far2))
                POLISH_NAME(add)(s, place, slot[lane], start->margin[slot[lane]]);
        }
        pairs->count++;
    }
    return is_clear;
}

/* Searches for solutions near fold points. Returns whether it is certain that all solutions of the
 * pose are found. `first` contains the data (pivots, squared step length, trace) that Newton's
 * iteration records for the first step of each branch. */
static LANES_TARGET int POLISH_NAME(unfold)(POLISH_NAME(search) * s,
                                            const POLISH_NAME(slots) * start, const double *first)
{
    POLISH_NAME(folds) f;
    POLISH_NAME(pairs) pairs;
    const double unsure = POLISH_UNSURE * POLISH_DEVIATION;
    int slot[LANES], count = 0, reached = 0, is_clear = 1;
    pairs.count = 0;
    for (int k = 0; k < POLISH_SLOTS; k++) {
        const double part = start->residual[k] * (1.0 / POLISH_LENGTH);
        reached += start->residual[k] < POLISH_FOLD;
        const double *own = first + 4 * LANES * (k / LANES) + k % LANES;
        if (s->taken[k]) {
            is_clear = is_clear && !POLISH_NAME(is_swerved)(own[2 * LANES], own[3 * LANES]);
        } else if (POLISH_NAME(is_folded)(start->residual[k], own[0])) {
            /* If the second pivot of J J^T is small too, the search at the fold point does not find
             * all solutions. */
            is_clear = is_clear && !(own[LANES] < unsure * unsure);
            for (int i = 0; i < POLISH_N; i++)
                ((double *)f.c.q)[LANES * i + count] = start->q[POLISH_N * k + i];
            slot[count++] = k;
        } else {
            is_clear = is_clear && !POLISH_NAME(is_aside)(part * part, own[0], own[2 * LANES]);
        }
        if (count == LANES || (k + 1 == POLISH_SLOTS && count > 0)) {
            is_clear = POLISH_NAME(part)(s, start, &f, slot, count, &pairs) && is_clear;
            count = 0;
        }
    }
    if (s->waiting > 0)
        POLISH_NAME(follow)(s);
    for (int k = 0; k < pairs.count && is_clear; k++) {
        is_clear = POLISH_NAME(is_known)(s, pairs.q[k][0], pairs.far2[k]) &&
                   POLISH_NAME(is_known)(s, pairs.q[k][1], pairs.far2[k]);
    }
    return is_clear && s->count > 0 && s->count % 2 == 0 && s->count >= reached;
}
