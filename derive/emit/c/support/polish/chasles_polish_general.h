/* Adds the solutions of the general inverse kinematics solver to the known solutions. Each solution
 * is stored in the solution slot of the nearest branch, or in an extra slot. This file is part of
 * chasles and is the same for every robot. The header chasles_polish.h includes this file once for
 * each robot that the general solver supports. */
/* Stores a further inverse kinematics solution. If an inaccurate copy of the solution is stored,
 * the solution replaces this copy. A solution without an inaccurate copy is stored in the free slot
 * of the nearest nominal branch, or in an extra slot. */
static void POLISH_NAME(place)(POLISH_NAME(search) * s, const POLISH_NAME(slots) * start,
                               const double *q, double residual)
{
    double least = INFINITY, least_free = INFINITY;
    int branch = 0, slot = -1, same = -1;
    for (int k = 0; k < POLISH_SLOTS; k++) {
        const double apart2 = POLISH_NAME(apart2)(q, start->q + POLISH_N * k);
        if (apart2 < least)
            least = apart2, branch = k;
        if (!s->taken[k] && apart2 < least_free)
            least_free = apart2, slot = k;
    }
    for (int k = 0; k < POLISH_RESULTS; k++) {
        if (!s->taken[k] && POLISH_NAME(same)(q, s->q + POLISH_N * k, POLISH_SAME))
            same = k;
        if (!s->taken[k] && slot < 0)
            slot = k;
    }
    slot = same < 0 ? slot : same;
    if (slot < 0)
        return;
    memcpy(s->q + POLISH_N * slot, q, POLISH_N * sizeof *q);
    s->residual[slot] = residual;
    s->margin[slot] = start->margin[branch];
    s->taken[slot] = 1;
    s->count++;
}

/* Returns whether solutions may be missing. Solutions may be missing if their number is zero, odd,
 * or less than the number of nominal branches that reach the pose. */
static int POLISH_NAME(is_short)(const POLISH_NAME(search) * s, const POLISH_NAME(slots) * start)
{
    int reached = 0;
    for (int k = 0; k < POLISH_SLOTS; k++)
        reached += start->residual[k] < POLISH_FOLD;
    return s->count == 0 || s->count % 2 || s->count < reached;
}

/* Returns 1 if the residual of every branch of the nominal arm is at least POLISH_FARTHEST. */
static int POLISH_NAME(is_far)(const POLISH_NAME(slots) * start)
{
    for (int k = 0; k < POLISH_SLOTS; k++) {
        if (start->residual[k] < POLISH_FARTHEST)
            return 0;
    }
    return 1;
}

/* Returns whether each real root of the determinant belongs to exactly one known solution and
 * whether no two roots are near each other. A return value of 1 means that all solutions are known.
 */
static int POLISH_NAME(is_one_each)(const POLISH_NAME(search) * s, const chasles_general_six *six,
                                    const chasles_general_order *order,
                                    const chasles_circle_roots *roots)
{
    const int joint = order->joint[2], own = six->own[joint];
    const double sign = order->sense * chasles_general_direction(six, joint);
    int real = 0;
    for (int i = 0; i < roots->count; i++) {
        int near = 0;
        if (roots->imaginary[i] > CHASLES_DOUBT)
            continue;
        real++;
        for (int k = 0; k < roots->count; k++) {
            const double apart = chasles_circle_wrapped(roots->angle[k] - roots->angle[i]);
            near += fabs(apart) < CHASLES_TWINS;
        }
        near += roots->imaginary[i] > 0.0;
        for (int k = 0; k < POLISH_RESULTS; k++) {
            const double along = sign * s->q[POLISH_N * k + own];
            const double apart = chasles_circle_wrapped(along - roots->angle[i]);
            near += s->taken[k] && fabs(apart) < 0.5 * CHASLES_TWINS;
        }
        if (near != 2)
            return 0;
    }
    return real == s->count && real % 2 == 0;
}

/* Computes the value of the suppressed joint of an elimination order for each known solution.
 * Returns the number of known solutions. */
static int POLISH_NAME(roots)(const POLISH_NAME(search) * s, const chasles_general_six *six,
                              const chasles_general_order *order, double *root)
{
    const int joint = order->joint[2], own = six->own[joint];
    const double sign = order->sense * chasles_general_direction(six, joint);
    int count = 0;
    for (int k = 0; k < POLISH_RESULTS; k++) {
        if (s->taken[k])
            root[count++] = sign * s->q[POLISH_N * k + own];
    }
    return count;
}

/* Judges whether all inverse kinematics solutions are known. Elimination orders are tested until
 * one order gives a clear verdict. An elimination order is skipped if two known solutions have
 * nearly the same suppressed joint angle, for example the same elbow angle. `system` receives the
 * equations of the last tested elimination order, and `decisive` receives this order. If no
 * elimination order is tested, `decisive` is null. */
static chasles_polish_verdict POLISH_NAME(verdict)(const POLISH_NAME(search) * s,
                                                   const chasles_general_six *six, int orders,
                                                   chasles_general_system *system,
                                                   const chasles_general_order **decisive)
{
    double root[POLISH_RESULTS];
    chasles_polish_verdict verdict = CHASLES_UNCLEAR;
    *decisive = NULL;
    for (int k = 0; k < orders && verdict == CHASLES_UNCLEAR; k++) {
        const chasles_general_order *order = six->arm->order + k;
        const int count = POLISH_NAME(roots)(s, six, order, root);
        if (!chasles_polish_may_be_all(root, count))
            continue;
        chasles_general_eliminate(six, order, s->in, system);
        *decisive = order;
        verdict = chasles_polish_are_all(system, root, count);
    }
    return verdict;
}

/* Runs the general inverse kinematics solver unless the known solutions are complete. Returns
 * whether it is certain that all solutions of the pose are found. */
static int POLISH_NAME(solve_generally)(const POLISH_NAME(search) * s,
                                        const POLISH_NAME(slots) * start,
                                        const chasles_general_six *six,
                                        chasles_general_found *found)
{
    chasles_general_system system;
    chasles_circle_roots roots;
    const chasles_general_order *decisive;
    found->count = 0;
    /* If solutions may be missing, only one elimination order is tested, because further orders
     * cannot prove completeness. */
    const int orders = POLISH_NAME(is_short)(s, start) ? 1 : six->arm->orders;
    if (POLISH_NAME(verdict)(s, six, orders, &system, &decisive) == CHASLES_COMPLETE)
        return 1;
    for (int k = 0; k < six->arm->orders; k++) {
        const chasles_general_order *order = six->arm->order + k;
        if (k > 0 || order != decisive)
            chasles_general_eliminate(six, order, s->in, &system);
        const int is_certain = chasles_general_isolated(&system, &roots);
        if (is_certain && POLISH_NAME(is_one_each)(s, six, order, &roots))
            return 1;
        if (chasles_general_by_roots(six, s->in, order, &system, &roots, found) && is_certain &&
            (found->count > 0 || k > 0))
            return 1;
    }
    /* If the axis deviation is large, the search along pose lines may miss solutions. The solver
     * therefore also starts from solutions of nearby poses. */
    return POLISH_IS_ASKED && chasles_general_by_nearby(six, s->in, found);
}

/* Adds the solutions of the general solver that are not yet in the list. */
static void POLISH_NAME(add_found)(POLISH_NAME(search) * s, const POLISH_NAME(slots) * start,
                                   const chasles_general_six *six,
                                   const chasles_general_found *found)
{
    double q[POLISH_N];
    for (int k = 0; k < found->count; k++) {
        chasles_general_joints(six, found->q[k], q);
        if (!POLISH_NAME(known)(s, q))
            POLISH_NAME(place)(s, start, q, found->residual[k]);
    }
}

/* Runs the general inverse kinematics solver and adds its solutions. Returns whether it is certain
 * that all solutions of the pose are found. */
static int POLISH_NAME(ask)(POLISH_NAME(search) * s, const POLISH_NAME(slots) * start)
{
    chasles_general_six six;
    chasles_general_found found;
    for (int i = 0; i < POLISH_INPUTS; i++) {
        if (!isfinite(s->in[i]))
            return 0;
    }
    chasles_general_set(&POLISH_GENERAL, s->in + 16, &six);
    const int is_certain = POLISH_NAME(solve_generally)(s, start, &six, &found);
    POLISH_NAME(add_found)(s, start, &six, &found);
    return is_certain;
}

/* Adds solutions near a self-motion of the nominal arm, if some branches nearly reach the pose. */
static void POLISH_NAME(walk)(POLISH_NAME(search) * s, const POLISH_NAME(slots) * start)
{
    chasles_general_six six;
    chasles_general_found found = {0};
    double least = INFINITY;
    for (int k = 0; k < POLISH_SLOTS; k++)
        least = s->residual[k] < least ? s->residual[k] : least;
    if (!(least < CHASLES_NEAR))
        return;
    chasles_general_set(&POLISH_GENERAL, s->in + 16, &six);
    chasles_general_by_self_motion(&six, s->in, &found);
    POLISH_NAME(add_found)(s, start, &six, &found);
}
