/* Solves loops without a closed form by Newton's iteration, which follows a path from a known
 * configuration. This file is part of chasles and is the same for every robot.
 *
 * A robot function with loops first calls `at` or `seeded`, which compute the loop variables w. The
 * robot function then calls `factored`, and functions of chasles_closure_rates.h for derivatives.
 *
 * This file is included once for each robot, which defines the following macros and tables.
 *
 *   CLOSURE_NAME(name)         is the name of a function or table of the robot.
 *   CLOSURE_Q, CLOSURE_W       are the numbers of actuated coordinates and of loop variables.
 *   CLOSURE_U, CLOSURE_M       are the numbers of unknown variables and of equations (M >= U).
 *   CLOSURE_AT(s)              computes the equations s->c and their derivative s->D (M x W)
 *                              at s->w.
 *   CLOSURE_BEND(w, wd, D)     computes the time derivative D of the Jacobian s->D at w, for
 *                              the rates wd.
 *   The table actuated         contains the index of the variable of each coordinate.
 *   The table ratio            contains the derivative of each actuated variable by its coordinate.
 *   The table unknown          contains the indices of the unknown variables.
 *   The tables size_u, size_c  contain the scales of unknowns and equations: a length (meter) or 1.
 *   The table of_z             contains the index of each variable in z.
 *   The tables start_q, start_w contain the reference configuration.
 *   The table tangent          contains the derivative du/dq at the reference configuration.
 *   CLOSURE_SENSE              is the sign of det c_u at the reference, or 0 if c_u is not square.
 *   CLOSURE_DETERMINANT        is the magnitude of det c_u at the reference configuration.
 *   CLOSURE_RESUMES            states whether an inverse resumes from its last loop variables.
 *
 * The closure equations c have the derivatives c_a and c_u by the actuated variables a and the
 * unknown variables u. While a moves along a straight line from a known configuration to the given
 * values, u follows the tangent c_u du = -c_a da. After each step, Newton's iteration solves c_u
 * du = -c to close the loops, in the least-squares sense if M > U.
 *
 * The first step spans the complete path. A path step is halved if Newton's iteration does not
 * contract or det c_u changes its sign, so that u stays on its branch. The path ends early at a
 * singularity, where c_u is rank deficient, or after CLOSURE_MAX linear systems.
 *
 * Source: Deuflhard, Newton Methods for Nonlinear Problems, 2011, sections 2.1 and 5.1. The code
 * allocates nothing and has no state.
 */
#include <stddef.h>
#include <string.h>

#include "chasles_closure_newton.h"

/* Computes the rates x of the unknown variables from the coordinate rates qd. The matrix D_u must
 * already be factored. */
static void CLOSURE_NAME(slope)(const CLOSURE_NAME(closed) * s, const double qd[CLOSURE_Q],
                                double x[CLOSURE_U])
{
    double b[CLOSURE_M];
    for (int i = 0; i < CLOSURE_M; i++) {
        b[i] = 0.0;
        for (int k = 0; k < CLOSURE_Q; k++)
            b[i] -=
                s->D[i * CLOSURE_W + CLOSURE_NAME(actuated)[k]] * CLOSURE_NAME(ratio)[k] * qd[k];
    }
    CLOSURE_NAME(solve)(s, b, x);
}

/* Moves the loop configuration s->w to the coordinates q, and returns 1 on success, otherwise 0.
 * The loops must be nearly closed at the initial configuration s->w. */
static int CLOSURE_NAME(follow)(CLOSURE_NAME(closed) * s, const double q[CLOSURE_Q], double sense,
                                double tangent[CLOSURE_U])
{
    double from[CLOSURE_W], displacement[CLOSURE_Q], done = 0.0, stride = 1.0;
    const double contraction = CLOSURE_M == CLOSURE_U ? CLOSURE_CONTRACTION : CLOSURE_CAREFUL;
    memcpy(from, s->w, sizeof from);
    for (int k = 0; k < CLOSURE_Q; k++)
        displacement[k] = q[k] - from[CLOSURE_NAME(actuated)[k]] / CLOSURE_NAME(ratio)[k];
    while (s->count < CLOSURE_MAX) {
        const int is_last = stride >= 1.0 - done;
        const double to = is_last ? 1.0 : done + stride;
        for (int k = 0; k < CLOSURE_Q; k++) {
            const double rest = (to - 1.0) * displacement[k];
            s->w[CLOSURE_NAME(actuated)[k]] = CLOSURE_NAME(ratio)[k] * (q[k] + rest);
        }
        for (int k = 0; k < CLOSURE_U; k++) {
            const int u = CLOSURE_NAME(unknown)[k];
            s->w[u] = from[u] + (to - done) * tangent[k];
        }
        if (CLOSURE_NAME(corrected)(s, sense, contraction, is_last)) {
            if (is_last)
                return CLOSURE_NAME(is_closed)(s);
            memcpy(from, s->w, sizeof from);
            CLOSURE_NAME(slope)(s, displacement, tangent);
            done = to;
            stride *= 2.0;
        } else {
            stride = (is_last ? 1.0 - done : stride) / 2.0;
            if (!(stride >= CLOSURE_SHORTEST))
                return 0;
        }
    }
    return 0;
}

/* Computes the loop variables w at the coordinates q, along the path from the reference
 * configuration. */
static void CLOSURE_NAME(at)(CLOSURE_NAME(closed) * s, const double q[CLOSURE_Q],
                             double w[CLOSURE_W])
{
    double tangent[CLOSURE_U], finite = 0.0;
    s->count = 0;
    memcpy(s->w, CLOSURE_NAME(start_w), sizeof s->w);
    for (int k = 0; k < CLOSURE_U; k++)
        tangent[k] = 0.0;
    for (int j = 0; j < CLOSURE_Q; j++) {
        const double displacement = q[j] - CLOSURE_NAME(start_q)[j];
        finite += 0.0 * displacement;
        for (int k = 0; k < CLOSURE_U; k++)
            tangent[k] += CLOSURE_NAME(tangent)[k * CLOSURE_Q + j] * displacement;
    }
    const int is_reached = finite == 0.0 && CLOSURE_NAME(follow)(s, q, CLOSURE_SENSE, tangent);
    CLOSURE_NAME(reached)(s, is_reached);
    memcpy(w, s->w, sizeof s->w);
}

/* Computes the loop variables w at the coordinates q by Newton's iteration from a nearby
 * configuration z. */
static void CLOSURE_NAME(seeded)(CLOSURE_NAME(closed) * s, const double q[CLOSURE_Q],
                                 const double *z, double w[CLOSURE_W])
{
    for (int k = 0; k < CLOSURE_W; k++)
        s->w[k] = z[CLOSURE_NAME(of_z)[k]];
    CLOSURE_NAME(near)(q, s);
    memcpy(w, s->w, sizeof s->w);
}

#if CLOSURE_RESUMES
/* Computes the loop variables w at the coordinates q by Newton's iteration from the given w. If w
 * is NaN or too far from the solution, the computation starts from the reference configuration. */
static void CLOSURE_NAME(resumed)(CLOSURE_NAME(closed) * s, const double q[CLOSURE_Q],
                                  double w[CLOSURE_W])
{
    memcpy(s->w, w, sizeof s->w);
    if (w[0] == w[0])
        CLOSURE_NAME(near)(q, s);
    if (s->w[0] != s->w[0])
        CLOSURE_NAME(at)(s, q, w);
    memcpy(w, s->w, sizeof s->w);
}
#endif

#include "chasles_closure_rates.h"

#undef CLOSURE_NAME
#undef CLOSURE_Q
#undef CLOSURE_W
#undef CLOSURE_U
#undef CLOSURE_M
#undef CLOSURE_AT
#undef CLOSURE_BEND
#undef CLOSURE_SENSE
#undef CLOSURE_DETERMINANT
#undef CLOSURE_RESUMES
