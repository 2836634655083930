/* Steps of Newton's iteration on lanes, a configuration a lane; part of chasles, the same for every
 * robot whose inverse is led from a nominal arm. Included by chasles_polish.h, once for each robot.
 */
/* Configurations on lanes: coordinates; pose and Jacobian there; the twist to the pose, its lengths
 * in parts of the arm's; the squares of this twist and of the residual. */
typedef struct {
    lanes q[POLISH_N], at[16 + 6 * POLISH_N], e[6], cost, residual2;
} POLISH_NAME(configurations);

/* Solutions of the nominal arm: coordinates, residuals, margins, in the order of its results. */
typedef struct {
    double q[POLISH_SLOTS * POLISH_N], residual[POLISH_SLOTS], margin[POLISH_SLOTS];
} POLISH_NAME(slots);

/* Computes pose, Jacobian and errors at the coordinates. */
POLISH_INLINE void POLISH_NAME(evaluate)(const double *T, POLISH_NAME(configurations) * c)
{
    POLISH_POSE(c->q, c->at);
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
    /* The axis times twice the tangent of half the angle, bounded near half a turn. */
    const lanes factor = 2.0 / POLISH_MAX(trace + 1.0, POLISH_HALF_TURN);
    c->cost = distance2 * (1.0 / (POLISH_LENGTH * POLISH_LENGTH));
    for (int i = 0; i < 3; i++) {
        c->e[3 + i] = factor * w[i];
        c->cost += c->e[3 + i] * c->e[3 + i];
    }
    /* The square of the residual of every inverse: NaN where one of the two is. */
    lanes difference = distance2 - 0.5 * turned2;
    difference = LANES_CHOICE(LANES_LT(difference, 0.0), -difference, difference);
    c->residual2 = 0.5 * (distance2 + 0.5 * turned2 + difference);
}

/* Solves the symmetric a x = b for right sides b; a is given by its lower half, and x replaces b.
 * Keeps the two least pivots, which are squares of lengths. */
POLISH_INLINE void POLISH_NAME(solve)(lanes a[POLISH_ROWS][POLISH_ROWS], lanes (*b)[POLISH_ROWS],
                                      int sides, lanes *pivots)
{
    /* a = L D L^T: L D replaces the lower half, L, transposed, the upper, 1 / D the diagonal. */
    POLISH_UNROLL
    for (int i = 0; i < POLISH_ROWS; i++) {
        POLISH_UNROLL
        for (int j = 1; j < i; j++) {
            POLISH_UNROLL
            for (int k = 0; k < j; k++)
                a[i][j] -= a[i][k] * a[k][j];
        }
        POLISH_UNROLL
        for (int j = 0; j < i; j++) {
            a[j][i] = a[i][j] * a[j][j];
            a[i][i] -= a[j][i] * a[i][j];
            for (int m = 0; m < sides; m++)
                b[m][i] -= a[j][i] * b[m][j];
        }
        const lanes greater = POLISH_MAX(pivots[0], a[i][i]);
        pivots[0] = POLISH_MIN(pivots[0], a[i][i]);
        pivots[1] = POLISH_MIN(pivots[1], greater);
        a[i][i] = 1.0 / a[i][i];
    }
    POLISH_UNROLL
    for (int i = POLISH_ROWS - 1; i >= 0; i--) {
        for (int m = 0; m < sides; m++) {
            b[m][i] *= a[i][i];
            POLISH_UNROLL
            for (int j = i + 1; j < POLISH_ROWS; j++)
                b[m][i] -= a[i][j] * b[m][j];
        }
    }
}

/* Solves the same equations once more for another right side. */
POLISH_INLINE void POLISH_NAME(solve_again)(lanes a[POLISH_ROWS][POLISH_ROWS], lanes *b)
{
    POLISH_UNROLL
    for (int i = 0; i < POLISH_ROWS; i++) {
        POLISH_UNROLL
        for (int j = 0; j < i; j++)
            b[i] -= a[j][i] * b[j];
    }
    POLISH_UNROLL
    for (int i = POLISH_ROWS - 1; i >= 0; i--) {
        b[i] *= a[i][i];
        POLISH_UNROLL
        for (int j = i + 1; j < POLISH_ROWS; j++)
            b[i] -= a[i][j] * b[j];
    }
}

#if POLISH_N >= 6
/* The lower half of J J^T with `added` on the diagonal. */
POLISH_INLINE void POLISH_NAME(squared)(lanes (*J)[POLISH_N], const lanes *added, lanes a[6][6])
{
    POLISH_UNROLL
    for (int i = 0; i < 6; i++) {
        POLISH_UNROLL
        for (int j = 0; j <= i; j++) {
            a[i][j] = i == j ? *added : POLISH_OF(0.0);
            POLISH_UNROLL
            for (int k = 0; k < POLISH_N; k++)
                a[i][j] += J[i][k] * J[j][k];
        }
    }
}
#endif

/* The Jacobian, with lengths in parts of the arm's and without the coordinates that are given. */
POLISH_INLINE void POLISH_NAME(weighted)(const POLISH_NAME(configurations) * c,
                                         lanes (*J)[POLISH_N])
{
    static const double is_free[] = POLISH_FREE;
    POLISH_UNROLL
    for (int i = 0; i < 6; i++) {
        POLISH_UNROLL
        for (int k = 0; k < POLISH_N; k++)
            J[i][k] =
                c->at[16 + POLISH_N * i + k] * (i < 3 ? is_free[k] / POLISH_LENGTH : is_free[k]);
    }
}

/* Moves q by dq, each coordinate by POLISH_STEP at most, angles by the shorter way round. */
POLISH_INLINE void POLISH_NAME(move)(const lanes *from, const lanes *dq, lanes *q)
{
    static const double turns[] = POLISH_TURNS;
    lanes longest = POLISH_OF(POLISH_STEP);
    for (int k = 0; k < POLISH_N; k++)
        longest = POLISH_MAX(longest, POLISH_MAX(dq[k], -dq[k]));
    const lanes part = POLISH_STEP / longest;
    for (int k = 0; k < POLISH_N; k++) {
        const lanes moved = from[k] + part * dq[k];
        /* A number of less than 2^51 in a sum with 1.5 * 2^52 is rounded to a whole one. */
        const lanes whole = (moved * turns[k] + 6755399441055744.0) - 6755399441055744.0;
        q[k] = turns[k] > 0.0 ? moved - whole * 6.283185307179586 : moved;
    }
}

/* The matrix of the damped step's equations: J^T J or, with six coordinates and more, J J^T. */
POLISH_INLINE void POLISH_NAME(equations)(lanes (*J)[POLISH_N], const lanes *added,
                                          lanes a[POLISH_ROWS][POLISH_ROWS])
{
#if POLISH_N < 6
    POLISH_UNROLL
    for (int i = 0; i < POLISH_ROWS; i++) {
        POLISH_UNROLL
        for (int j = 0; j <= i; j++) {
            a[i][j] = i == j ? *added : POLISH_OF(0.0);
            POLISH_UNROLL
            for (int k = 0; k < 6; k++)
                a[i][j] += J[k][i] * J[k][j];
        }
    }
#else
    POLISH_NAME(squared)(J, added, a);
#endif
}

/* The right side of these equations for a twist e. */
POLISH_INLINE void POLISH_NAME(right_side)(lanes (*J)[POLISH_N], const lanes *e, lanes *b)
{
#if POLISH_N < 6
    POLISH_UNROLL
    for (int i = 0; i < POLISH_ROWS; i++) {
        b[i] = POLISH_OF(0.0);
        POLISH_UNROLL
        for (int k = 0; k < 6; k++)
            b[i] += J[k][i] * e[k];
    }
#else
    (void)J;
    for (int i = 0; i < 6; i++)
        b[i] = e[i];
#endif
}

/* The step dq of a solution of these equations. */
POLISH_INLINE void POLISH_NAME(step_of)(lanes (*J)[POLISH_N], const lanes *b, lanes *dq)
{
#if POLISH_N < 6
    (void)J;
    for (int k = 0; k < POLISH_N; k++)
        dq[k] = b[k];
#else
    POLISH_UNROLL
    for (int k = 0; k < POLISH_N; k++) {
        dq[k] = J[0][k] * b[0];
        POLISH_UNROLL
        for (int i = 1; i < 6; i++)
            dq[k] += J[i][k] * b[i];
    }
#endif
}

/* The damped step dq from c. `pivots` are the least of its equations. */
POLISH_INLINE void POLISH_NAME(towards)(const POLISH_NAME(configurations) * c, const lanes *damping,
                                        lanes *dq, lanes *pivots)
{
    lanes J[6][POLISH_N], a[POLISH_ROWS][POLISH_ROWS], b[1][POLISH_ROWS];
    const lanes added = *damping * c->cost + POLISH_LEAST_DAMPING;
    POLISH_NAME(weighted)(c, J);
    POLISH_NAME(equations)(J, &added, a);
    POLISH_NAME(right_side)(J, c->e, b[0]);
    POLISH_NAME(solve)(a, b, 1, pivots);
    POLISH_NAME(step_of)(J, b[0], dq);
}

#if POLISH_IS_SEARCHED
/* The twist of second order by which a step dq of a chain of joints misses, lengths in parts of the
 * arm's: half the acceleration at these rates. A joint moves the columns of J behind it as w x
 * does, and w x of those behind is what they do to its own. */
POLISH_INLINE void POLISH_NAME(missed)(lanes (*J)[POLISH_N], const lanes *dq, lanes *e)
{
    lanes turned[3];
    for (int i = 0; i < 3; i++)
        turned[i] = e[i] = e[3 + i] = POLISH_OF(0.0);
    POLISH_UNROLL
    for (int k = 0; k < POLISH_N; k++) {
        const lanes half = 0.5 * dq[k];
        lanes before[3];
        POLISH_UNROLL
        for (int i = 0; i < 3; i++)
            before[i] = turned[i] + half * J[3 + i][k];
        POLISH_UNROLL
        for (int i = 0; i < 3; i++) {
            const int l = (i + 1) % 3, m = (i + 2) % 3;
            e[i] += dq[k] * (before[l] * J[m][k] - before[m] * J[l][k]);
            e[3 + i] += half * (turned[l] * J[3 + m][k] - turned[m] * J[3 + l][k]);
        }
        POLISH_UNROLL
        for (int i = 0; i < 3; i++)
            turned[i] = before[i] + half * J[3 + i][k];
    }
}

/* Moves q by a damped step of third order from c (Chebyshev's): what Newton's step misses to second
 * order is taken back by the same equations, unless that is more than a part of the step; `part2`
 * is the square of this part. `pivots` are the least of the equations. */
POLISH_INLINE void POLISH_NAME(curved)(const POLISH_NAME(configurations) * c, const lanes *damping,
                                       lanes *q, lanes *pivots, lanes *part2)
{
    lanes J[6][POLISH_N], a[POLISH_ROWS][POLISH_ROWS], b[1][POLISH_ROWS], e[6];
    lanes dq[POLISH_N], back[POLISH_N], square = POLISH_OF(1e-300), of_back = POLISH_OF(0.0);
    const lanes added = *damping * c->cost + POLISH_LEAST_DAMPING;
    POLISH_NAME(weighted)(c, J);
    POLISH_NAME(equations)(J, &added, a);
    POLISH_NAME(right_side)(J, c->e, b[0]);
    POLISH_NAME(solve)(a, b, 1, pivots);
    POLISH_NAME(step_of)(J, b[0], dq);
    POLISH_NAME(missed)(J, dq, e);
    POLISH_NAME(right_side)(J, e, b[0]);
    POLISH_NAME(solve_again)(a, b[0]);
    POLISH_NAME(step_of)(J, b[0], back);
    for (int k = 0; k < POLISH_N; k++) {
        square += dq[k] * dq[k];
        of_back += back[k] * back[k];
    }
    *part2 = of_back / square;
    const lanes_where is_small = LANES_LT(*part2, POLISH_OF(POLISH_MOST_BACK * POLISH_MOST_BACK));
    for (int k = 0; k < POLISH_N; k++)
        dq[k] -= LANES_CHOICE(is_small, back[k], 0.0);
    POLISH_NAME(move)(c->q, dq, q);
}
#endif

/* Moves q by the damped step from c. `pivots` are the least of its equations. */
POLISH_INLINE void POLISH_NAME(step)(const POLISH_NAME(configurations) * c, const lanes *damping,
                                     lanes *q, lanes *pivots)
{
    lanes dq[POLISH_N];
    POLISH_NAME(towards)(c, damping, dq, pivots);
    POLISH_NAME(move)(c->q, dq, q);
}

/* Steps from the nominal solutions that are `near`; other lanes keep their coordinates. `first`
 * holds the least pivots of the first step, without damping but where near, and the square of the
 * part of this step that is taken back for the bend of the way. */
static LANES_TARGET void POLISH_NAME(newton)(const double *T, const lanes_where *near,
                                             POLISH_NAME(configurations) * c, lanes *first)
{
    const lanes damping = LANES_CHOICE(*near, POLISH_DAMPING, 0.0);
    lanes_where going = *near;
    lanes q[POLISH_N], others[3];
    first[0] = first[1] = others[0] = others[1] = POLISH_OF(1.0);
    for (int k = 0;; k++) {
        POLISH_NAME(evaluate)(T, c);
#if !POLISH_IS_SEARCHED
        /* Where the true loops are on another branch, the tool is far away. */
        if (k == 0)
            going = POLISH_AND(going, LANES_LT(c->cost, POLISH_OF(POLISH_ON_BRANCH)));
#endif
        const lanes_where left = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
        if (k == POLISH_STEPS || (k > 0 && !LANES_ANY(POLISH_AND(left, going))))
            return;
        lanes *pivots = k > 0 ? others : first;
#if POLISH_IS_SEARCHED
        POLISH_NAME(curved)(c, &damping, q, pivots, pivots + 2);
#else
        POLISH_NAME(step)(c, &damping, q, pivots);
#endif
        for (int i = 0; i < POLISH_N; i++)
            c->q[i] = LANES_CHOICE(going, q[i], c->q[i]);
    }
}

/* The same from a start that may be far: a step that increases the error is not taken, and the next
 * is damped more. */
static LANES_TARGET void POLISH_NAME(descend)(const double *T, POLISH_NAME(configurations) * c)
{
    lanes damping = POLISH_OF(1.0);
    POLISH_NAME(evaluate)(T, c);
    lanes_where going = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
    for (int k = 0; k < POLISH_MOST_STEPS && LANES_ANY(going); k++) {
        POLISH_NAME(configurations) next;
        lanes pivots[2] = {damping, damping};
        POLISH_NAME(step)(c, &damping, next.q, pivots);
        POLISH_NAME(evaluate)(T, &next);
        const lanes_where better = POLISH_AND(going, LANES_LT(next.cost, c->cost));
        const lanes_where slow = LANES_LT(POLISH_SLOW * c->cost, next.cost);
        const lanes_where small = LANES_LT(c->residual2, POLISH_SETTLED * POLISH_SETTLED);
        const lanes_where stuck = POLISH_OR(POLISH_AND(better, slow), POLISH_AND(small, slow));
        damping *= LANES_CHOICE(better, 0.1, 100.0);
        const lanes_where hopeless = LANES_LT(POLISH_MOST_DAMPING, damping);
        const lanes *from = next.q;
        lanes *to = c->q;
        for (size_t i = 0; i < sizeof next / sizeof *to; i++)
            to[i] = LANES_CHOICE(better, from[i], to[i]);
        const lanes_where left = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
        going = POLISH_AND(POLISH_AND(going, left), POLISH_NOT(POLISH_OR(stuck, hopeless)));
    }
}

#if !POLISH_IS_SEARCHED
/* The same near a dead point, beyond which the loops do not close: steps without damping, of which
 * one that does not decrease the error is halved. */
static LANES_TARGET void POLISH_NAME(approach)(const double *T, POLISH_NAME(configurations) * c)
{
    const lanes undamped = POLISH_OF(0.0);
    lanes part = POLISH_OF(1.0);
    POLISH_NAME(evaluate)(T, c);
    lanes_where going = LANES_LT(POLISH_CLOSED * POLISH_CLOSED, c->residual2);
    for (int k = 0; k < POLISH_MOST_HALVED && LANES_ANY(going); k++) {
        POLISH_NAME(configurations) next;
        lanes dq[POLISH_N], pivots[2] = {part, part};
        POLISH_NAME(towards)(c, &undamped, dq, pivots);
        for (int i = 0; i < POLISH_N; i++)
            dq[i] *= part;
        POLISH_NAME(move)(c->q, dq, next.q);
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
                                            LANES_LT(part, POLISH_OF(POLISH_LEAST_PART)));
        going = POLISH_AND(POLISH_AND(going, left), POLISH_NOT(ended));
    }
}
#endif

/* Takes the slots from `first` on to lanes; lanes without a slot repeat the last. */
POLISH_INLINE void POLISH_NAME(load)(const double *q, int first, POLISH_NAME(configurations) * c)
{
    double *rows = (double *)c->q;
    for (int k = 0; k < LANES; k++) {
        const int slot = first + k < POLISH_SLOTS ? first + k : POLISH_SLOTS - 1;
        for (int i = 0; i < POLISH_N; i++)
            rows[LANES * i + k] = q[POLISH_N * slot + i];
    }
}

/* Stores a lane in a slot. */
POLISH_INLINE void POLISH_NAME(store)(const POLISH_NAME(configurations) * c, int lane, double *q,
                                      double *residual)
{
    const double *rows = (const double *)c->q;
    for (int i = 0; i < POLISH_N; i++)
        q[i] = rows[LANES * i + lane];
    *residual = sqrt(((const double *)&c->residual2)[lane]);
}

/* Whether two configurations are one. */
static int POLISH_NAME(same)(const double *a, const double *b)
{
    static const double turns[] = POLISH_TURNS;
    for (int i = 0; i < POLISH_N; i++) {
        const double apart = fabs(a[i] - b[i]), other = 6.283185307179586 - apart;
        if (!(apart < POLISH_SAME) && !(turns[i] > 0.0 && other < POLISH_SAME))
            return 0;
    }
    return 1;
}

#if POLISH_UNFOLDS || POLISH_IS_GENERAL
/* The square of the distance of two configurations (rad, m). */
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
