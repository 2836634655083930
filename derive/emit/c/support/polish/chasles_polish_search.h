/* Searches for solutions that Newton's iteration does not reach from the nominal solutions. This
 * file is part of chasles and is the same for every robot. The header chasles_polish.h includes
 * this file once for each robot.
 *
 * Near a singularity, even a small deviation of the true arm from the nominal arm moves solutions
 * far away. The search uses poses on a straight line through the target pose T, called the pose
 * line. The pose at the line parameter mu is the target pose T displaced by -mu u, where u is a
 * constant twist. At both ends of the pose line, the nominal arm is far from its singularity.
 * Newton's iteration therefore finds the solutions of the true arm at both ends of the pose line.
 * From a solution at an end of the pose line, the search follows a curve of configurations. At
 * every configuration of this curve, the pose error relative to the target T is mu u, a multiple of
 * the constant twist u. The curve of configurations may pass through fold points, where two
 * solution branches meet. Where a curve of configurations crosses mu = 0, the configuration is a
 * solution of the target pose T. */
/* The solutions found so far, and a queue of start configurations. Newton's iteration begins when
 * the queue of start configurations fills all SIMD lanes. */
typedef struct {
    const double *in;
    double *q, *residual, *margin;
    int taken[POLISH_RESULTS]; /* whether the solution slot contains a new solution */
    int count;                 /* number of new solutions */
    int directions; /* number of pose lines that are searched even if they give no new solutions */
    int waiting, slot[LANES];
    double margin_of[LANES];
    POLISH_NAME(configurations) c;
} POLISH_NAME(search);

/* Returns whether a configuration is already stored in an occupied solution slot. */
static int POLISH_NAME(known)(const POLISH_NAME(search) * s, const double *q)
{
    for (int k = 0; k < POLISH_RESULTS; k++) {
        if (s->taken[k] && POLISH_NAME(same)(q, s->q + POLISH_N * k, POLISH_SAME))
            return 1;
    }
    return 0;
}

/* Marks the slots whose solution does not occur in an earlier slot. */
static void POLISH_NAME(mark)(POLISH_NAME(search) * s)
{
    s->count = 0;
    memset(s->taken, 0, sizeof s->taken);
    for (int k = 0; k < POLISH_RESULTS; k++) {
        if (s->residual[k] <= POLISH_SETTLED && !POLISH_NAME(known)(s, s->q + POLISH_N * k)) {
            s->taken[k] = 1;
            s->count++;
        }
    }
}

/* Stores the result that Newton's iteration reached from one start configuration. A new solution is
 * stored in the slot of its branch or, if this slot is occupied, in another slot. A slot without a
 * solution stores the result with the smallest residual. */
static void POLISH_NAME(keep)(POLISH_NAME(search) * s, int lane)
{
    double found[POLISH_N], left;
    int slot = s->slot[lane];
    POLISH_NAME(store)(&s->c, lane, found, &left);
    if (!(left <= POLISH_SETTLED)) {
        if (!(left < s->residual[slot]))
            return;
    } else {
        if (s->count == POLISH_RESULTS || POLISH_NAME(known)(s, found))
            return;
        for (int k = 0; s->taken[slot]; k++)
            slot = k;
        s->taken[slot] = 1;
        s->count++;
    }
    memcpy(s->q + POLISH_N * slot, found, sizeof found);
    s->residual[slot] = left;
    s->margin[slot] = s->margin_of[lane];
}

/* Copies the values of the first SIMD lane to lane `count` and to all later lanes. */
static void POLISH_NAME(repeat)(double *rows, int n, int count)
{
    for (int i = 0; i < n; i++) {
        for (int k = count; k < LANES; k++)
            rows[LANES * i + k] = rows[LANES * i];
    }
}

#if POLISH_IS_SEARCHED
/* Continues Newton's iteration for a slot whose solution is valid but not yet converged. Returns
 * whether Newton's iteration converges to a solution that another slot already contains. */
static LANES_TARGET int POLISH_NAME(is_led_to_known)(POLISH_NAME(search) * s, int slot)
{
    double found[POLISH_N], left, *rows = (double *)s->c.q;
    for (int i = 0; i < POLISH_N; i++)
        rows[LANES * i] = s->q[POLISH_N * slot + i];
    POLISH_NAME(repeat)(rows, POLISH_N, 1);
    POLISH_NAME(descend)(s->in, &s->c);
    POLISH_NAME(store)(&s->c, 0, found, &left);
    if (left <= POLISH_SETTLED && POLISH_NAME(known)(s, found))
        return 1;
    if (left < s->residual[slot]) {
        memcpy(s->q + POLISH_N * slot, found, sizeof found);
        s->residual[slot] = left;
    }
    return 0;
}
#endif

/* Empties a solution slot that repeats the solution of another slot. */
static LANES_TARGET void POLISH_NAME(empty_copy)(POLISH_NAME(search) * s, int slot)
{
    double *q = s->q + POLISH_N * slot;
    int is_copy = 0;
    s->taken[slot] = 0;
#if POLISH_IS_SEARCHED
    if (s->residual[slot] > POLISH_SETTLED)
        is_copy = POLISH_NAME(is_led_to_known)(s, slot);
#endif
    const double near = s->residual[slot] > POLISH_SETTLED ? POLISH_SAME_AT_BORDER : POLISH_SAME;
    for (int k = 0; k < POLISH_RESULTS; k++) {
        is_copy = is_copy || (k != slot && s->residual[k] <= POLISH_SOLVED &&
                              POLISH_NAME(same)(q, s->q + POLISH_N * k, near));
    }
    if (!is_copy)
        return;
    s->residual[slot] = NAN;
    for (int i = 0; i < POLISH_N; i++)
        q[i] = NAN;
}

/* Runs Newton's iteration from the queued start configurations to the target pose. */
static LANES_TARGET void POLISH_NAME(follow)(POLISH_NAME(search) * s)
{
    POLISH_NAME(repeat)((double *)s->c.q, POLISH_N, s->waiting);
    POLISH_NAME(descend)(s->in, &s->c);
    for (int k = 0; k < s->waiting; k++)
        POLISH_NAME(keep)(s, k);
    s->waiting = 0;
}

/* Adds a start configuration of Newton's iteration, and the slot of its solution branch, to the
 * queue. */
static LANES_TARGET void POLISH_NAME(add)(POLISH_NAME(search) * s, const double *q, int slot,
                                          double margin)
{
    double *rows = (double *)s->c.q + s->waiting;
    for (int i = 0; i < POLISH_N; i++)
        rows[LANES * i] = q[i];
    s->slot[s->waiting] = slot;
    s->margin_of[s->waiting] = margin;
    s->waiting++;
    if (s->waiting == LANES)
        POLISH_NAME(follow)(s);
}

/* Computes a twist in one of six directions, linear part first. The argument `direction` selects
 * the direction of the twist. */
static void POLISH_NAME(direction)(int direction, double size, double *u)
{
    /* The six axes through opposite corners of an icosahedron, which are evenly distributed in
     * space. */
    static const double axes[6][3] = {
        {0.0, 0.53, 0.85},  {0.53, 0.85, 0.0},  {0.85, 0.0, 0.53},
        {0.0, -0.53, 0.85}, {-0.53, 0.85, 0.0}, {0.85, 0.0, -0.53},
    };
    for (int i = 0; i < 3; i++) {
        u[i] = size * axes[(direction + 2) % 6][i];
        u[3 + i] = size * axes[direction % 6][i];
    }
}

/* Computes the inputs of the inverse kinematics function for a pose near the target pose. The
 * difference between the two poses is a twist. */
static void POLISH_NAME(nearby)(const double *in, double size, int direction, double *near)
{
    double u[6];
    POLISH_NAME(direction)(direction, size, u);
    const double a = 0.5 * u[3], b = 0.5 * u[4], c = 0.5 * u[5];
    const double n = 1.0 / (1.0 + a * a + b * b + c * c);
    /* The matrix R is computed with Cayley's formula, so that R is a rotation. */
    const double R[3][3] = {
        {n * (1.0 + a * a - b * b - c * c), 2.0 * n * (a * b - c), 2.0 * n * (a * c + b)},
        {2.0 * n * (a * b + c), n * (1.0 - a * a + b * b - c * c), 2.0 * n * (b * c - a)},
        {2.0 * n * (a * c - b), 2.0 * n * (b * c + a), n * (1.0 - a * a - b * b + c * c)},
    };
    memcpy(near, in, POLISH_INPUTS * sizeof *in);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            near[4 * i + k] = R[i][0] * in[k] + R[i][1] * in[4 + k] + R[i][2] * in[8 + k];
        near[4 * i + 3] += POLISH_LENGTH * u[i];
    }
}

/* Returns whether the upper left block of a pose is a rotation; a pose without a rotation has no
 * solutions. */
static int POLISH_NAME(is_rigid)(const double *T)
{
    double off = 0.0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = i == j ? -1.0 : 0.0;
            for (int k = 0; k < 3; k++)
                sum += T[4 * i + k] * T[4 * j + k];
            off = fabs(sum) > off ? fabs(sum) : off;
        }
    }
    return off <= POLISH_RIGID;
}

/* Searches for solutions of uncertain branches, starting from the nominal arm's solutions at poses
 * near the target. */
static void POLISH_NAME(around)(POLISH_NAME(search) * s, const int *is_unsure)
{
    POLISH_NAME(slots) other;
    double near[POLISH_INPUTS];
    for (int direction = 0; direction < POLISH_DIRECTIONS && s->count < POLISH_RESULTS;
         direction++) {
        for (int side = -1; side <= 1; side += 2) {
            POLISH_NAME(nearby)(s->in, side * POLISH_AROUND * POLISH_DEVIATION, direction, near);
            POLISH_NOMINAL(near, (double *)&other);
            for (int k = 0; k < POLISH_SLOTS; k++) {
                if (is_unsure[k] && other.residual[k] < POLISH_START)
                    POLISH_NAME(add)(s, other.q + POLISH_N * k, k, other.margin[k]);
            }
        }
    }
}

#if POLISH_N >= 6
/* The parameter mu of the pose line runs from -POLISH_HALF to POLISH_HALF. With this range, changes
 * of mu are about as large as changes of joint angles (radian). */
#define POLISH_HALF sqrt(POLISH_LINE *POLISH_DEVIATION)

/* Curves of configurations that the search follows, one per SIMD lane. */
typedef struct {
    POLISH_NAME(configurations) c;
    lanes mu, along[POLISH_N + 1], left;
    int count, slot[LANES],
        is_branch[LANES]; /* whether the nominal arm reaches the end of the pose line */
    double margin[LANES];
    int side, arrived; /* the end of the pose line at which the curves start (-1 or 1), and the
                          number of curves that reached the other end */
} POLISH_NAME(curves);

/* Moves each configuration onto its curve by the smallest first-order change of (q, mu). On the
 * curve, the pose error is mu u. The previous direction of the curve, projected onto the tangent,
 * becomes the new direction. */
POLISH_INLINE void POLISH_NAME(correct)(const double *T, const double *u, POLISH_NAME(curves) * k)
{
    lanes J[6][POLISH_N], a[6][6], b[2][6], dq[POLISH_N];
    lanes pivots[2] = {POLISH_OF(1.0), POLISH_OF(1.0)}, size = POLISH_OF(0.0);
    POLISH_NAME(evaluate)(T, &k->c);
    POLISH_NAME(weighted)(&k->c, J);
    k->left = POLISH_OF(0.0);
    POLISH_UNROLL
    for (int i = 0; i < 6; i++) {
        b[0][i] = k->c.e[i] - k->mu * u[i];
        b[1][i] = k->along[POLISH_N] * u[i];
        k->left += b[0][i] * b[0][i];
        POLISH_UNROLL
        for (int m = 0; m < POLISH_N; m++)
            b[1][i] += J[i][m] * k->along[m];
        POLISH_UNROLL
        for (int j = 0; j <= i; j++) {
            a[i][j] = POLISH_OF(u[i] * u[j] + (i == j ? POLISH_MIN_DAMPING : 0.0));
            POLISH_UNROLL
            for (int m = 0; m < POLISH_N; m++)
                a[i][j] += J[i][m] * J[j][m];
        }
    }
    POLISH_NAME(solve)(a, b, 2, pivots);
    POLISH_UNROLL
    for (int m = 0; m < POLISH_N; m++) {
        dq[m] = POLISH_OF(0.0);
        POLISH_UNROLL
        for (int i = 0; i < 6; i++) {
            dq[m] += J[i][m] * b[0][i];
            k->along[m] -= J[i][m] * b[1][i];
        }
    }
    for (int i = 0; i < 6; i++) {
        k->mu += u[i] * b[0][i];
        k->along[POLISH_N] -= u[i] * b[1][i];
    }
    POLISH_NAME(move)(k->c.q, dq, k->c.q);
    for (int m = 0; m <= POLISH_N; m++)
        size += k->along[m] * k->along[m];
    POLISH_RSQRT(scale, size);
    for (int m = 0; m <= POLISH_N; m++)
        k->along[m] *= scale;
}

/* Queues a start configuration of Newton's iteration where a curve crosses or nearly touches mu =
 * 0. The start configuration is interpolated between two curve points, at the fraction `part` of
 * their distance. */
static void POLISH_NAME(cross)(POLISH_NAME(search) * s, const POLISH_NAME(curves) * k, int lane,
                               const lanes *before, double part)
{
    double q[POLISH_N];
    for (int i = 0; i < POLISH_N; i++) {
        const double from = ((const double *)before)[LANES * i + lane];
        const double change = ((const double *)k->c.q)[LANES * i + lane] - from;
        q[i] = from + part * remainder(change, 6.283185307179586);
    }
    POLISH_NAME(add)(s, q, k->slot[lane], k->margin[lane]);
}

/* Follows the curves of configurations to the ends of the pose line, one curve per SIMD lane.
 * Queues a start configuration wherever a curve crosses or nearly touches the target pose at mu =
 * 0. */
static LANES_TARGET void POLISH_NAME(trace)(POLISH_NAME(search) * s, const double *u,
                                            POLISH_NAME(curves) * k)
{
    const double half = POLISH_HALF;
    POLISH_NAME(repeat)((double *)k->c.q, POLISH_N, k->count);
    POLISH_NAME(repeat)((double *)&k->mu, 1, k->count);
    POLISH_NAME(repeat)((double *)k->along, POLISH_N + 1, k->count);
    lanes before[POLISH_N], last = k->mu, earlier = k->mu;
    lanes_where going = LANES_LT(POLISH_OF(0.0), POLISH_OF(1.0));
    for (int step = 0; step < POLISH_MAX_STRIDES && LANES_ANY(going); step++) {
        POLISH_NAME(correct)(s->in, u, k);
        if (step >= POLISH_STEPS / 2) {
            const double *now = (const double *)&k->mu, *then = (const double *)&last;
            const double *first = (const double *)&earlier;
            const lanes_where on = LANES_LT(k->left, POLISH_OFF_CURVE * POLISH_OFF_CURVE);
            const lanes mu2 = k->mu * k->mu;
            const lanes alive = LANES_CHOICE(POLISH_AND(going, on), 1.0, 0.0);
            going = POLISH_AND(going, POLISH_AND(on, LANES_LT(mu2, POLISH_OF(1.2 * half * half))));
            for (int lane = 0; lane < k->count && step > POLISH_STEPS / 2; lane++) {
                const double a = fabs(first[lane]), b = fabs(then[lane]), c = fabs(now[lane]);
                if (((const double *)&alive)[lane] == 0.0)
                    continue;
                k->arrived +=
                    k->is_branch[lane] && c > half && b <= half && now[lane] * k->side < 0.0;
                if (then[lane] * now[lane] <= 0.0) {
                    POLISH_NAME(cross)(s, k, lane, before, b / (b + c + 1e-300));
                } else if (b < a && b < c && b < POLISH_TOUCH * half &&
                           first[lane] * then[lane] > 0.0) {
                    /* Fits a parabola to |mu| at three curve points, as if they were equidistant.
                     * Queues the real roots of the parabola, or its minimum if it has no real root.
                     */
                    const double sum = 0.5 * (a + c) - b, middle = 0.25 * (a - c) / sum;
                    const double apart2 = middle * middle - b / sum;
                    const double apart = apart2 > 0.0 ? sqrt(apart2) : 0.0;
                    POLISH_NAME(cross)(s, k, lane, before, middle + apart);
                    if (apart > 0.0)
                        POLISH_NAME(cross)(s, k, lane, before, middle - apart);
                }
            }
            earlier = step > POLISH_STEPS / 2 ? last : k->mu;
            last = k->mu;
            memcpy(before, k->c.q, sizeof before);
            const lanes slope = k->along[POLISH_N], slope2 = slope * slope + 1e-30;
            const lanes rest2 = 1.0 - slope * slope, part2 = POLISH_MAX(rest2, 1e-3);
            POLISH_RSQRT(of_coordinates, part2);
            POLISH_RSQRT(of_line, slope2);
            const lanes most =
                POLISH_MIN(POLISH_STRIDE * of_coordinates, POLISH_SHARE * half * of_line);
            const lanes stride = LANES_CHOICE(going, most, 0.0);
            for (int i = 0; i < POLISH_N; i++)
                k->c.q[i] += stride * k->along[i];
            k->mu += stride * slope;
        }
    }
    k->count = 0;
}

/* Adds a curve that starts at the configuration `from` and at the value `mu` of the pose line
 * parameter. If `k->side` is 1, mu first decreases along the curve. If `k->side` is -1, mu first
 * increases. */
static LANES_TARGET void POLISH_NAME(begin)(POLISH_NAME(search) * s, const double *u,
                                            POLISH_NAME(curves) * k, const double *from, int slot,
                                            double mu, double margin)
{
    double *q = (double *)k->c.q + k->count, *along = (double *)k->along + k->count;
    for (int i = 0; i < POLISH_N; i++) {
        q[LANES * i] = from[i];
        along[LANES * i] = 0.0;
    }
    along[LANES * POLISH_N] = -k->side;
    ((double *)&k->mu)[k->count] = mu;
    k->slot[k->count] = slot;
    k->margin[k->count++] = margin;
    if (k->count == LANES)
        POLISH_NAME(trace)(s, u, k);
}

/* Searches for missing solutions along lines of poses. */
static LANES_TARGET void POLISH_NAME(look)(POLISH_NAME(search) * s, const int *is_unsure)
{
    POLISH_NAME(slots) other;
    POLISH_NAME(curves) k;
    double near[POLISH_INPUTS], u[6];
    k.count = 0;
    for (int direction = 0; direction < POLISH_DIRECTIONS && s->count < POLISH_RESULTS;
         direction++) {
        const int known = s->count;
        int begun = 0;
        POLISH_NAME(direction)(direction, POLISH_HALF, u);
        k.arrived = 0;
        for (k.side = -1; k.side <= 1; k.side += 2) {
            int starts = 0;
            POLISH_NAME(nearby)(s->in, -k.side * POLISH_LINE * POLISH_DEVIATION, direction, near);
            POLISH_NOMINAL(near, (double *)&other);
            for (int slot = 0; slot < POLISH_SLOTS; slot++)
                starts += is_unsure[slot] && other.residual[slot] < POLISH_FOLD;
            begun += starts;
            /* Curves from this end of the pose line need not be followed if at least as many curves
             * arrived from the other end. */
            if (k.side > 0 && s->count > 0 && starts <= k.arrived)
                break;
            for (int slot = 0; slot < POLISH_SLOTS; slot++) {
                k.is_branch[k.count] = other.residual[slot] < POLISH_FOLD;
                const double *q = other.q + POLISH_N * slot;
                if (is_unsure[slot] && other.residual[slot] < POLISH_FOLD)
                    POLISH_NAME(begin)(s, u, &k, q, slot, k.side * POLISH_HALF, other.margin[slot]);
                else if (is_unsure[slot] && s->count == 0 && s->residual[slot] < POLISH_START)
                    POLISH_NAME(begin)(s, u, &k, s->q + POLISH_N * slot, slot, 0.0,
                                       s->margin[slot]);
            }
            if (k.count > 0)
                POLISH_NAME(trace)(s, u, &k);
        }
        if (s->waiting > 0)
            POLISH_NAME(follow)(s);
        if (begun > 0 && s->count > 0 && s->count == known && direction + 1 >= s->directions)
            break;
    }
}
#endif
