/* Steps of Newton's iteration, with one configuration per SIMD lane. This file is part of chasles
 * and is the same for every robot. The header chasles_polish.h includes this file once for each
 * robot.
 */
/* Configurations in SIMD lanes. `at` contains the pose and the Jacobian, `e` the twist to the
 * target (lengths relative to the arm length), and `cost` the squared length of `e`. */
typedef struct {
    lanes q[POLISH_N], at[16 + 6 * POLISH_N], e[6], cost, residual2;
#if POLISH_SEEDS
    lanes seed[POLISH_SEEDS];
#endif
} POLISH_NAME(configurations);

/* Nominal solutions, as coordinates, residuals and margins in output order. */
typedef struct {
    double q[POLISH_SLOTS * POLISH_N], residual[POLISH_SLOTS], margin[POLISH_SLOTS];
} POLISH_NAME(slots);

#if POLISH_ON_LANES
static __attribute__((noinline)) LANES_TARGET void POLISH_NAME(pose)(const lanes *q, lanes *at)
{
    POLISH_POSE(q, at);
}

/* Computes only the pose; the compiler removes the operations of the unused Jacobian. */
static __attribute__((noinline)) LANES_TARGET void POLISH_NAME(tool_pose)(const lanes *q, lanes *at)
{
    lanes all[16 + 6 * POLISH_N];
    POLISH_POSE(q, all);
    memcpy(at, all, 16 * sizeof *at);
}
#else
#if !POLISH_SEEDS
static void POLISH_NAME(pose)(const lanes *q, lanes *at)
{
    POLISH_POSE(q, at);
}
#endif

static void POLISH_NAME(tool_pose)(const lanes *q, lanes *at)
{
    POLISH_POSE(q, at);
}
#endif

/* Computes the twist from the pose of c to the target pose T, and the norms of this twist. */
POLISH_INLINE void POLISH_NAME(compare)(const double *T, POLISH_NAME(configurations) * c)
{
    const lanes *at = c->at;
    lanes distance2 = POLISH_OF(0.0), turned2 = distance2, trace = distance2;
    lanes w[3] = {distance2, distance2, distance2};
    for (int i = 0; i < 3; i++) {
        const lanes apart = T[4 * i + 3] - at[4 * i + 3];
        c->e[i] = apart * (1.0 / POLISH_LENGTH);
        distance2 += apart * apart;
        for (int k = 0; k < 3; k++) {
            const lanes d = T[4 * i + k] - at[4 * i + k];
            turned2 += d * d;
            trace += T[4 * i + k] * at[4 * i + k];
        }
    }
    for (int k = 0; k < 3; k++) {
        w[0] += at[4 + k] * T[8 + k] - at[8 + k] * T[4 + k];
        w[1] += at[8 + k] * T[k] - at[k] * T[8 + k];
        w[2] += at[k] * T[4 + k] - at[4 + k] * T[k];
    }
    /* The rotation error is the rotation axis times twice the tangent of half the angle. The bound
     * POLISH_HALF_TURN keeps the rotation error finite near half a turn. */
    const lanes factor = 2.0 / POLISH_MAX(trace + 1.0, POLISH_HALF_TURN);
    c->cost = distance2 * (1.0 / (POLISH_LENGTH * POLISH_LENGTH));
#if POLISH_IS_POSITION
    for (int i = 0; i < 3; i++)
        c->e[3 + i] = POLISH_OF(0.0);
    c->residual2 = distance2;
    return;
#endif
    for (int i = 0; i < 3; i++) {
        c->e[3 + i] = factor * w[i];
        c->cost += c->e[3 + i] * c->e[3 + i];
    }
    /* The squared residual of an inverse kinematics solution is the larger of the squared position
     * error and the squared rotation error. */
    lanes difference = distance2 - 0.5 * turned2;
    difference = LANES_CHOICE(LANES_LT(difference, 0.0), -difference, difference);
    c->residual2 = 0.5 * (distance2 + 0.5 * turned2 + difference);
}

/* Computes the tool pose, the Jacobian and the pose errors at the coordinates of each SIMD lane. */
POLISH_INLINE void POLISH_NAME(evaluate)(const double *T, POLISH_NAME(configurations) * c)
{
#if POLISH_SEEDS
    POLISH_FROM_SEED(c->q, c->seed, c->at);
#else
    POLISH_NAME(pose)(c->q, c->at);
#endif
    POLISH_NAME(compare)(T, c);
}

/* Computes the Jacobian without the columns of fixed coordinates, with lengths relative to the arm
 * length. */
POLISH_INLINE void POLISH_NAME(weighted)(const POLISH_NAME(configurations) * c,
                                         lanes (*J)[POLISH_N])
{
    static const double is_free[] = POLISH_FREE;
    const double scale[2] = {1.0 / POLISH_LENGTH, POLISH_IS_POSITION ? 0.0 : 1.0};
    POLISH_UNROLL
    for (int i = 0; i < 6; i++) {
        POLISH_UNROLL
        for (int k = 0; k < POLISH_N; k++)
            J[i][k] = c->at[16 + POLISH_N * i + k] * (is_free[k] * scale[i / 3]);
    }
}

/* Shifts each angle by full turns, so that the angle is within half a turn of zero, or of its
 * reference value for robots with loops solved by iteration. */
POLISH_INLINE void POLISH_NAME(unwind)(lanes *q)
{
    static const double turns[] = POLISH_TURNS;
#if POLISH_SEEDS
    static const double middle[] = POLISH_REFERENCE;
#endif
    for (int k = 0; k < POLISH_N; k++) {
#if POLISH_SEEDS
        const lanes apart = q[k] - middle[k];
#else
        const lanes apart = q[k];
#endif
        /* Adding 1.5 * 2^52 rounds a number below 2^51 to an integer. */
        const lanes whole = (apart * turns[k] + 6755399441055744.0) - 6755399441055744.0;
        q[k] = turns[k] > 0.0 ? q[k] - whole * 6.283185307179586 : q[k];
    }
}

/* Moves the coordinates q by the step dq, and then shifts angles by full turns. A long step dq is
 * shortened so that each coordinate moves by at most POLISH_STEP. */
POLISH_INLINE void POLISH_NAME(move)(const lanes *from, const lanes *dq, lanes *q)
{
    lanes longest = POLISH_OF(POLISH_STEP);
    for (int k = 0; k < POLISH_N; k++)
        longest = POLISH_MAX(longest, POLISH_MAX(dq[k], -dq[k]));
    const lanes part = POLISH_STEP / longest;
    for (int k = 0; k < POLISH_N; k++)
        q[k] = from[k] + part * dq[k];
    POLISH_NAME(unwind)(q);
}

/* The factored linear equations of a Newton step, and the Jacobian at the start of this step. */
typedef struct {
    lanes J[6][POLISH_N], a[POLISH_ROWS][POLISH_ROWS];
} POLISH_NAME(factors);

/* Computes the damped step dq from the configuration c. `pivots` receives the smallest pivots of
 * the equations of the step. */
POLISH_INLINE void POLISH_NAME(towards)(const POLISH_NAME(configurations) * c, const lanes *damping,
                                        POLISH_NAME(factors) * f, lanes *dq, lanes *pivots)
{
    lanes b[1][POLISH_ROWS];
    const lanes added = *damping * c->cost + POLISH_MIN_DAMPING;
    POLISH_NAME(weighted)(c, f->J);
    POLISH_NAME(equations)(f->J, &added, f->a);
    POLISH_NAME(right_side)(f->J, c->e, b[0]);
    POLISH_NAME(solve)(f->a, b, 1, pivots);
    POLISH_NAME(step_of)(f->J, b[0], dq);
}

/* Moves q by the damped step from the configuration c. `pivots` receives the smallest pivots of the
 * equations of the step. */
POLISH_INLINE void POLISH_NAME(step)(const POLISH_NAME(configurations) * c, const lanes *damping,
                                     lanes *q, lanes *pivots)
{
    POLISH_NAME(factors) f;
    lanes dq[POLISH_N];
    POLISH_NAME(towards)(c, damping, &f, dq, pivots);
    POLISH_NAME(move)(c->q, dq, q);
}

/* Returns the squared norm of a step. */
POLISH_INLINE void POLISH_NAME(size2)(const lanes *dq, lanes *square)
{
    *square = dq[0] * dq[0];
    for (int k = 1; k < POLISH_N; k++)
        *square += dq[k] * dq[k];
}

/* Applies the joint step `dq` in the SIMD lanes that the mask `going` selects. */
POLISH_INLINE void POLISH_NAME(moved)(const lanes_where *going, const lanes *dq,
                                      POLISH_NAME(configurations) * c)
{
    lanes q[POLISH_N];
    POLISH_NAME(move)(c->q, dq, q);
    for (int i = 0; i < POLISH_N; i++)
        c->q[i] = LANES_CHOICE(*going, q[i], c->q[i]);
}

#if POLISH_N < 6 && POLISH_IS_SEARCHED
/* Returns whether it is certain that no solution is near the configuration c. No solution is near c
 * if the linearized error after a step exceeds the largest error that curvature can cause for this
 * step length. Near singularities (small `pivots`), damping shortens the step, so the function
 * returns false. */
POLISH_INLINE lanes_where POLISH_NAME(misses)(const POLISH_NAME(configurations) * c,
                                              const POLISH_NAME(factors) * f, const lanes *dq,
                                              const lanes *pivots)
{
    static const double turns[] = POLISH_TURNS;
    const lanes damping = POLISH_DAMPING * c->cost;
    lanes rest2 = POLISH_OF(0.0), length2 = rest2;
    for (int k = 0; k < POLISH_N; k++) {
        const lanes part = turns[k] > 0.0 ? dq[k] : dq[k] * (1.0 / POLISH_LENGTH);
        length2 += part * part;
    }
    const lanes bend = POLISH_BEND * length2;
    POLISH_UNROLL
    for (int i = 0; i < 6; i++) {
        lanes rest = c->e[i];
        POLISH_UNROLL
        for (int k = 0; k < POLISH_N; k++)
            rest -= f->J[i][k] * dq[k];
        rest2 += rest * rest;
    }
    const lanes_where is_long = LANES_LT(POLISH_UNDAMPED * damping, pivots[0]);
    return POLISH_AND(is_long, LANES_LT(bend * bend + POLISH_SETTLED * POLISH_SETTLED, rest2));
}
#endif

/* Runs Newton's iteration only in the SIMD lanes that the mask `near` selects. The smallest pivots
 * and the squared length of the first step are written to `first`. The first step is damped only in
 * the lanes that `near` selects. In a search at fold points, the trace of (J J^T)^-1 after the
 * first step is also written to `first`. The trace of (J J^T)^-1 is large near singularities. For
 * robots with loops, `first` receives the squared pose error at the start instead of the trace.
 * After a short Newton step, the next steps reuse the linear equations of this step, because the
 * Jacobian has hardly changed. If the arm has fewer than six joints, only some of its branches
 * reach the pose. Newton's iteration on a branch ends when the function `misses` shows that the
 * branch does not reach the pose. */
static LANES_TARGET void POLISH_NAME(newton)(const double *T, const lanes_where *near,
                                             POLISH_NAME(configurations) * c, lanes *first)
{
    POLISH_NAME(factors) f;
    const lanes damping = LANES_CHOICE(*near, POLISH_DAMPING, 0.0);
    lanes_where going = *near;
    lanes dq[POLISH_N], others[2], square;
    lanes *pivots = first;
    first[0] = first[1] = others[0] = others[1] = POLISH_OF(1.0);
    first[2] = first[3] = POLISH_OF(0.0);
    int left_over = 0; /* number of remaining steps that reuse the equations */
    for (int k = 0, taken = 0;; taken++) {
        if (left_over > 0) {
            POLISH_NAME(tool_pose)(c->q, c->at);
            POLISH_NAME(compare)(T, c);
        } else {
            POLISH_NAME(evaluate)(T, c);
        }
#if !POLISH_IS_SEARCHED
        /* If the loops of the true robot are on another branch than the loops of the nominal robot,
         * the tool is far from the target pose. */
        if (taken == 0) {
            first[3] = c->cost;
            going = POLISH_AND(going, LANES_LT(c->cost, POLISH_OF(POLISH_ON_BRANCH)));
        }
#endif
        const lanes_where left = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
        const int may_end =
            taken > 0 || !POLISH_IS_SEARCHED; /* the search at fold points needs the first step */
        if (k == POLISH_STEPS || (may_end && !LANES_ANY(POLISH_AND(left, going))))
            return;
        const int is_new = left_over == 0;
        if (is_new) {
            pivots = k > 0 ? others : first;
            POLISH_NAME(towards)(c, &damping, &f, dq, pivots);
            k++;
        } else {
            lanes b[POLISH_ROWS];
            POLISH_NAME(right_side)(f.J, c->e, b);
            POLISH_NAME(solve_again)(f.a, b);
            POLISH_NAME(step_of)(f.J, b, dq);
            left_over--;
        }
        POLISH_NAME(size2)(dq, &square);
        if (taken == 0)
            first[2] = square;
#if POLISH_UNFOLDS
        if (taken == 1)
            POLISH_NAME(inverse_trace)(f.a, first + 3);
#endif
        POLISH_NAME(moved)(&going, dq, c);
#if POLISH_N < 6 && POLISH_IS_SEARCHED
        if (is_new)
            going = POLISH_AND(going, POLISH_NOT(POLISH_NAME(misses)(c, &f, dq, pivots)));
#endif
        const lanes_where is_long = LANES_LT(POLISH_OF(POLISH_SHORT * POLISH_SHORT), square);
        if (POLISH_IS_SEARCHED && is_new && !LANES_ANY(POLISH_AND(going, is_long)))
            left_over = POLISH_MAX_AGAIN;
    }
}

/* Runs Newton's iteration from a possibly distant start; a step that increases the error is
 * rejected, and the next step is damped more. */
static LANES_TARGET void POLISH_NAME(descend)(const double *T, POLISH_NAME(configurations) * c)
{
    lanes damping = POLISH_OF(1.0);
    POLISH_NAME(evaluate)(T, c);
    lanes_where going = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
    for (int k = 0; k < POLISH_MAX_STEPS && LANES_ANY(going); k++) {
        POLISH_NAME(configurations) next;
        lanes pivots[2] = {damping, damping};
        POLISH_NAME(step)(c, &damping, next.q, pivots);
        POLISH_NAME(evaluate)(T, &next);
        const lanes_where better = POLISH_AND(going, LANES_LT(next.cost, c->cost));
        const lanes_where slow = LANES_LT(POLISH_SLOW * c->cost, next.cost);
        const lanes_where small = LANES_LT(c->residual2, POLISH_SETTLED * POLISH_SETTLED);
        const lanes_where stuck = POLISH_OR(POLISH_AND(better, slow), POLISH_AND(small, slow));
        damping *= LANES_CHOICE(better, 0.1, 100.0);
        const lanes_where hopeless = LANES_LT(POLISH_MAX_DAMPING, damping);
        const lanes *from = next.q;
        lanes *to = c->q;
        for (size_t i = 0; i < sizeof next / sizeof *to; i++)
            to[i] = LANES_CHOICE(better, from[i], to[i]);
        const lanes_where left = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
        going = POLISH_AND(POLISH_AND(going, left), POLISH_NOT(POLISH_OR(stuck, hopeless)));
    }
}

#if !POLISH_IS_SEARCHED
/* Runs Newton's iteration near a dead point, beyond which the loops cannot be closed. Each undamped
 * Newton step is halved until the step reduces the pose error. */
static LANES_TARGET void POLISH_NAME(approach)(const double *T, POLISH_NAME(configurations) * c)
{
    const lanes undamped = POLISH_OF(0.0);
    lanes part = POLISH_OF(1.0);
    POLISH_NAME(evaluate)(T, c);
    lanes_where going = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
    for (int k = 0; k < POLISH_MAX_HALVED && LANES_ANY(going); k++) {
        POLISH_NAME(configurations) next;
        POLISH_NAME(factors) f;
        lanes dq[POLISH_N], pivots[2] = {part, part};
        POLISH_NAME(towards)(c, &undamped, &f, dq, pivots);
        for (int i = 0; i < POLISH_N; i++)
            dq[i] *= part;
        POLISH_NAME(move)(c->q, dq, next.q);
#if POLISH_SEEDS
        memcpy(next.seed, c->seed, sizeof next.seed);
#endif
        POLISH_NAME(evaluate)(T, &next);
        const lanes_where better = POLISH_AND(going, LANES_LT(next.cost, c->cost));
        const lanes_where small = LANES_LT(c->residual2, POLISH_SETTLED * POLISH_SETTLED);
        const lanes *from = next.q;
        lanes *to = c->q;
        for (size_t i = 0; i < sizeof next / sizeof *to; i++)
            to[i] = LANES_CHOICE(better, from[i], to[i]);
        part = LANES_CHOICE(better, POLISH_MIN(2.0 * part, POLISH_OF(1.0)), 0.5 * part);
        const lanes_where left = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
        const lanes_where ended = POLISH_OR(POLISH_AND(small, POLISH_NOT(better)),
                                            LANES_LT(part, POLISH_OF(POLISH_MIN_PART)));
        going = POLISH_AND(POLISH_AND(going, left), POLISH_NOT(ended));
    }
}
#endif

/* Loads the solution slots from index `first` on into the SIMD lanes. Unused SIMD lanes repeat the
 * last solution slot. */
POLISH_INLINE void POLISH_NAME(load)(const double *q, int first, POLISH_NAME(configurations) * c)
{
    double *rows = (double *)c->q;
    for (int k = 0; k < LANES; k++) {
        const int slot = first + k < POLISH_SLOTS ? first + k : POLISH_SLOTS - 1;
        for (int i = 0; i < POLISH_N; i++)
            rows[LANES * i + k] = q[POLISH_N * slot + i];
    }
#if POLISH_SEEDS
    c->seed[0] = NAN;
    POLISH_NAME(unwind)(c->q);
#endif
}

/* Stores the result of a SIMD lane in a solution slot. */
POLISH_INLINE void POLISH_NAME(store)(const POLISH_NAME(configurations) * c, int lane, double *q,
                                      double *residual)
{
    const double *rows = (const double *)c->q;
    for (int i = 0; i < POLISH_N; i++)
        q[i] = rows[LANES * i + lane];
    *residual = sqrt(((const double *)&c->residual2)[lane]);
}

/* Returns whether two configurations differ by less than a tolerance in every coordinate. */
static int POLISH_NAME(same)(const double *a, const double *b, double tolerance)
{
    static const double turns[] = POLISH_TURNS;
    for (int i = 0; i < POLISH_N; i++) {
        const double apart = fabs(a[i] - b[i]), other = 6.283185307179586 - apart;
        if (!(apart < tolerance) && !(turns[i] > 0.0 && other < tolerance))
            return 0;
    }
    return 1;
}

#if POLISH_UNFOLDS || POLISH_IS_GENERAL
/* Returns the squared distance of two configurations (rad, m). */
static double POLISH_NAME(apart2)(const double *a, const double *b)
{
    static const double turns[] = POLISH_TURNS;
    double sum = 0.0;
    for (int i = 0; i < POLISH_N; i++) {
        double apart = fabs(a[i] - b[i]);
        if (turns[i] > 0.0)
            apart -= 6.283185307179586 * floor(apart * turns[i] + 0.5);
        sum += apart * apart;
    }
    return sum;
}
#endif
