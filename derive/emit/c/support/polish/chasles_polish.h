/* Inverse kinematics of an arm close to a known structure by Newton's iteration, which refines
 * every branch of the nominal arm to the true arm. This file is part of chasles and is the same for
 * every robot.
 *
 * The C code of each robot defines the following macros and includes this file.
 *
 *   POLISH_NAME(name)          is the name of a function of the robot.
 *   POLISH_N, POLISH_SLOTS     are the numbers of coordinates and of nominal solution slots.
 *   POLISH_RESULTS             is the number of nominal slots and extra slots together.
 *   POLISH_INPUTS              is the number of doubles in all inputs. The pose is the first input.
 *   POLISH_NOMINAL(in, out)    computes q, residual and margin of each slot of the nominal arm.
 *   POLISH_POSE(q, at)         computes the pose and the Jacobian of the true arm (meter, base
 *                              axes), in SIMD lanes.
 *   POLISH_FREE                is 1 for each coordinate that the iteration moves.
 *   POLISH_TURNS               is the number of revolutions per unit of each coordinate, or 0 for a
 *                              prismatic coordinate.
 *   POLISH_MOVING              is the number of coordinates that the iteration moves.
 *   POLISH_LENGTH              is the length of the arm (meter), which converts angles to lengths.
 *   POLISH_DEVIATION           is the axis deviation between the nominal and the true arm (radian,
 *                              or relative to POLISH_LENGTH).
 *   POLISH_MEETS               states whether three consecutive axes nearly intersect in one point.
 *
 *   POLISH_IS_GENERAL          states whether POLISH_GENERAL defines the arm for the general solver
 *                              (chasles_general.h), which completes uncertain branches.
 *   POLISH_IS_ASKED            states whether the general solver runs at every pose, because the
 *                              search at fold points may miss solutions.
 *   POLISH_IS_SEARCHED         states whether the solver also searches for solutions near uncertain
 *                              branches. POLISH_IS_SEARCHED is 0 for robots with loops, because the
 *                              true loops may not have a solution for each nominal branch.
 *   POLISH_IS_POSITION         states whether the target is a position only.
 *   POLISH_ON_LANES            states whether chasles_lanes.h was included before. If so, each SIMD
 *                              lane computes one branch.
 *   POLISH_SEEDS               is the number of variables of loops that are solved by iteration, or
 *                              0.
 *   POLISH_FROM_SEED(q, w, at) computes POLISH_POSE from nearby loop variables w, or from the
 *                              reference if w[0] is NaN. Sets w to the values at q.
 *   POLISH_REFERENCE           contains the reference coordinates. Angles stay within half a turn
 *                              of the reference, because loops may block full turns.
 *
 * Newton's step from q is dq = J^T (J J^T + lambda 1)^-1 e. Here, e is the twist from the tool to
 * the pose, and lambda is proportional to |e|^2. The damping acts near singularities and vanishes
 * with the error. Near singularities, the solutions of the true arm may be anywhere, so the
 * iteration also starts from nominal solutions of surrounding poses. The pose, the Jacobian and the
 * residual belong to the true arm. There is one exception: if the loops are solved by iteration and
 * the nominal arm is far from the pose, the slot keeps the residual of the nominal arm. The code
 * allocates nothing and has no state.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "chasles_polish_lanes.h"
#include "chasles_polish_tolerances.h"

/* Number of equations of a Newton step, which is six, or the number of coordinates if there are
 * fewer than six. */
#define POLISH_ROWS (POLISH_N < 6 ? POLISH_N : 6)
/* Whether the solver searches for pairs of branches at fold points. This search requires six moving
 * coordinates. */
#define POLISH_UNFOLDS (POLISH_MOVING == 6 && POLISH_IS_SEARCHED)

#include "chasles_polish_equations.h"
#include "chasles_polish_steps.h"
#include "chasles_polish_search.h"
#if POLISH_UNFOLDS
#include "chasles_polish_fold.h"
#endif
#if POLISH_IS_GENERAL
#include "chasles_polish_deflated.h"
#include "chasles_polish_general.h"
#endif

#if POLISH_IS_SEARCHED
/* Returns the number of pose lines in the search for further solutions near a branch. A pose line
 * is a straight line of poses through the target pose.
 *
 * If the pose is just out of reach of the nominal arm, two branches meet at a fold point. If the
 * Jacobian of the nominal arm is singular, the branches of the calibrated arm may be far from the
 * nominal branches. The argument `least` contains the two smallest pivots of the step equations. */
static int POLISH_NAME(lines)(double nominal, double residual, int is_distinct, const double *least)
{
    const double unsure = POLISH_UNSURE * POLISH_DEVIATION, square = unsure * unsure;
    const int first = least[0] < square, second = least[LANES] < square;
    if (!(nominal < POLISH_REACH)) {
        const int nearly = nominal < POLISH_DEVIATIONS(10.0) && least[LANES] < 9.0 * square;
        return first && (second || nearly) ? POLISH_FEW_DIRECTIONS : 0;
    }
    if (is_distinct && residual <= POLISH_SETTLED && !first)
        return 0;
    /* With fewer than six joints, only some branches reach the pose. */
    if (POLISH_N < 6 && !(residual <= POLISH_SETTLED) && !first)
        return 0;
    return nominal > POLISH_FOLD && !second ? 1 : POLISH_FEW_DIRECTIONS;
}
#endif

#if !POLISH_IS_SEARCHED
/* Repeats the iteration for diverged branches whose start values have a small pose error. */
static LANES_TARGET void POLISH_NAME(again)(const double *in, const double *start, int b,
                                            const lanes_where *near, const lanes *first,
                                            POLISH_NAME(configurations) * c)
{
    POLISH_NAME(configurations) next;
    const lanes_where settled = LANES_LT(c->residual2, POLISH_SETTLED * POLISH_SETTLED);
    const lanes_where on_branch = LANES_LT(first[3], POLISH_OF(POLISH_ON_BRANCH));
    const lanes_where astray = POLISH_AND(POLISH_AND(*near, on_branch), POLISH_NOT(settled));
    if (!LANES_ANY(astray))
        return;
    POLISH_NAME(load)(start, b, &next);
    POLISH_NAME(approach)(in, &next);
    const lanes *from = next.q;
    lanes *to = c->q;
    for (size_t i = 0; i < sizeof next / sizeof *to; i++)
        to[i] = LANES_CHOICE(astray, from[i], to[i]);
}

/* Refines all branches by Newton's iteration, and repeats the iteration of a diverging branch with
 * halved steps. */
static LANES_TARGET void POLISH_NAME(refined)(const double *in, const POLISH_NAME(slots) * start,
                                              int b, const lanes_where *near,
                                              POLISH_NAME(configurations) * c, lanes *first)
{
#if POLISH_SEEDS
    if (!LANES_ANY(*near)) {
        c->residual2 = start->residual[b] * start->residual[b];
        return;
    }
#endif
    POLISH_NAME(newton)(in, near, c, first);
    POLISH_NAME(again)(in, start->q, b, near, first, c);
#if POLISH_SEEDS
    /* The iteration from nearby loop variables and the iteration from the reference coordinates may
     * end on different loop branches. */
    if (LANES_LT(c->residual2, POLISH_SETTLED * POLISH_SETTLED)) {
        c->seed[0] = NAN;
        POLISH_NAME(evaluate)(in, c);
    }
#endif
}
#endif

/* Finds all solutions of the true arm, and stores each solution in the solution slot of a nominal
 * branch or in an extra slot. The same solution may occur in several solution slots. */
static LANES_TARGET void POLISH_NAME(find)(POLISH_NAME(search) * s, const double *in, double *q,
                                           double *residual, double *margin)
{
    POLISH_NAME(slots) start;
    lanes first[(POLISH_SLOTS + LANES - 1) / LANES][4];
#if POLISH_IS_SEARCHED
    int is_unsure[POLISH_SLOTS];
#endif
    POLISH_NOMINAL(in, (double *)&start);
    for (int b = 0; b < POLISH_SLOTS; b += LANES) {
        lanes nominal;
        POLISH_NAME(load)(start.q, b, &s->c);
        for (int k = 0; k < LANES; k++)
            ((double *)&nominal)[k] = start.residual[b + k < POLISH_SLOTS ? b + k : b];
        const lanes_where near =
            LANES_LT(nominal, POLISH_OF(POLISH_UNFOLDS ? POLISH_FOLD : POLISH_REACH));
#if POLISH_IS_SEARCHED
        POLISH_NAME(newton)(in, &near, &s->c, first[b / LANES]);
#else
        POLISH_NAME(refined)(in, &start, b, &near, &s->c, first[b / LANES]);
#endif
        for (int k = b; k < b + LANES && k < POLISH_SLOTS; k++)
            POLISH_NAME(store)(&s->c, k - b, q + POLISH_N * k, residual + k);
    }
    memcpy(margin, start.margin, sizeof start.margin);
    for (int k = POLISH_SLOTS; k < POLISH_RESULTS; k++) {
        residual[k] = margin[k] = NAN;
        for (int i = 0; i < POLISH_N; i++)
            q[POLISH_N * k + i] = NAN;
    }
    s->in = in, s->q = q, s->residual = residual, s->margin = margin,
    s->waiting = s->directions = 0;
    POLISH_NAME(mark)(s);
#if POLISH_IS_SEARCHED
#if POLISH_UNFOLDS
    if (POLISH_NAME(unfold)(s, &start, (const double *)first) && !POLISH_IS_ASKED)
        return;
#endif
#if POLISH_IS_GENERAL
    if (!POLISH_NAME(is_rigid)(in) ||
        (POLISH_NAME(ask)(s, &start) && (s->count > 0 || POLISH_NAME(is_far)(&start))))
        return;
#endif
    for (int k = 0; k < POLISH_SLOTS; k++) {
        const double *pivots = (const double *)first[k / LANES] + k % LANES;
        int directions = POLISH_NAME(lines)(start.residual[k], residual[k], s->taken[k], pivots);
        /* If no solution is known, the search includes all branches, because any branch may lead to
         * the smallest residual. */
        if (s->count == 0 && isfinite(start.residual[k]))
            directions = POLISH_FEW_DIRECTIONS;
        is_unsure[k] = directions > 0;
        s->directions = directions > s->directions ? directions : s->directions;
    }
    if (s->directions == 0 || !POLISH_NAME(is_rigid)(in))
        return;
    for (int k = 0; k < POLISH_SLOTS; k++) {
        if (is_unsure[k] && !s->taken[k])
            POLISH_NAME(add)(s, start.q + POLISH_N * k, k, start.margin[k]);
    }
    if (s->waiting > 0)
        POLISH_NAME(follow)(s);
#if POLISH_N >= 6
    POLISH_NAME(look)(s, is_unsure);
#endif
    /* With fewer than six joints, a line of poses in a generic direction leaves the set of
     * reachable poses. */
    if (POLISH_N < 6 || s->count == 0)
        POLISH_NAME(around)(s, is_unsure);
    if (s->waiting > 0)
        POLISH_NAME(follow)(s);
#if POLISH_IS_GENERAL
    if (s->count == 0)
        POLISH_NAME(walk)(s, &start);
#endif
#endif
}

/* Writes each solution of the true arm to exactly one solution slot. */
static LANES_TARGET void POLISH_NAME(polished)(const double *in, double *q, double *residual,
                                               double *margin)
{
    POLISH_NAME(search) s;
    POLISH_NAME(find)(&s, in, q, residual, margin);
    for (int k = 0; k < POLISH_RESULTS; k++) {
        const int is_settled = s.taken[k] && residual[k] <= POLISH_SETTLED;
        if (residual[k] <= POLISH_SOLVED && !is_settled)
            POLISH_NAME(empty_copy)(&s, k);
    }
}

#undef POLISH_NAME
#undef POLISH_N
#undef POLISH_SLOTS
#undef POLISH_RESULTS
#undef POLISH_INPUTS
#undef POLISH_NOMINAL
#undef POLISH_POSE
#undef POLISH_FREE
#undef POLISH_MOVING
#undef POLISH_TURNS
#undef POLISH_LENGTH
#undef POLISH_DEVIATION
#undef POLISH_MEETS
#undef POLISH_IS_GENERAL
#undef POLISH_IS_ASKED
#undef POLISH_IS_SEARCHED
#undef POLISH_IS_POSITION
#undef POLISH_GENERAL
#undef POLISH_ON_LANES
#undef POLISH_SEEDS
#undef POLISH_REFERENCE
#undef POLISH_FROM_SEED
#undef POLISH_ROWS
#undef POLISH_UNFOLDS
#undef POLISH_HALF
