/* Loops without a closed form: Newton's iteration on their equations, followed from a known
 * configuration; part of chasles, the same for every robot.
 *
 * Included once for each robot, which defines
 *
 *   CLOSURE_NAME(name)         the names of its functions and tables
 *   CLOSURE_Q, CLOSURE_W       actuated coordinates; variables of the equations
 *   CLOSURE_U, CLOSURE_M       unknown variables; equations, at least as many
 *   CLOSURE_AT(w, c, D)        the equations and their derivative, M x W
 *   CLOSURE_BEND(w, wd, D)     the rate of this derivative at rates wd
 *   CLOSURE_SWINGS             swings of struts, which follow from w:
 *   CLOSURE_SWING(w, s, D)     them and their derivative, SWINGS x W
 *   tables actuated, ratio     the variable of each coordinate, and its advance per unit of it
 *          unknown             the unknown variables
 *          size_u, size_c      what compares unknowns and equations: a length (metre), or 1
 *          start_q, start_w    the reference configuration
 *          tangent             du/dq there
 *   CLOSURE_SENSE              the sign of det c_u there, 0 where c_u is not square
 *   CLOSURE_DETERMINANT        its magnitude
 *
 * From a known configuration the actuated variables go to their values along a straight line, and
 * the unknown ones u follow:
 *
 *     c_u du = -c_a da           a step along the tangent
 *     c_u du = -c                Newton's iteration back onto the loops, least squares if M > U
 *
 * The first stride is the whole way. A stride is halved where the iteration does not contract or
 * the determinant changes its sign, so that u keeps its branch. The iteration ends at a
 * singularity, where c_u loses rank, and after CLOSURE_MOST linear systems at the latest.
 *
 * Source: Deuflhard, Newton Methods for Nonlinear Problems, 2011, 2.1 and 5.1. No allocation, no
 * state.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "chasles_closure_tolerances.h"

/* A configuration w with the equations c, their derivative D, and D_u = Q R by reflections: column
 * k of `qr` holds R above the diagonal and the reflection's vector from there on. */
typedef struct {
    double w[CLOSURE_W], c[CLOSURE_M], D[CLOSURE_M * CLOSURE_W];
    double qr[CLOSURE_U][CLOSURE_M], diagonal[CLOSURE_U], scale[CLOSURE_U];
    double sense;
    int count;
} CLOSURE_NAME(closed);

/* D_u = Q R. The sense is the sign of det D_u, 0 where D_u is not square. */
static void CLOSURE_NAME(factored)(CLOSURE_NAME(closed) * s)
{
    s->sense = CLOSURE_M == CLOSURE_U ? 1.0 : 0.0;
    for (int k = 0; k < CLOSURE_U; k++)
        for (int i = 0; i < CLOSURE_M; i++)
            s->qr[k][i] = s->D[i * CLOSURE_W + CLOSURE_NAME(unknown)[k]];
    for (int k = 0; k < CLOSURE_U; k++) {
        double *v = s->qr[k], square = 0.0;
        if (k == CLOSURE_M - 1) {
            s->diagonal[k] = v[k];
            s->scale[k] = 0.0;
            s->sense *= v[k] < 0.0 ? -1.0 : 1.0;
            continue;
        }
        for (int i = k; i < CLOSURE_M; i++)
            square += v[i] * v[i];
        const double norm = sqrt(square), first = v[k];
        s->diagonal[k] = first > 0.0 ? -norm : norm;
        v[k] = first - s->diagonal[k];
        s->scale[k] = 1.0 / (norm * fabs(v[k]));
        s->sense *= first > 0.0 ? 1.0 : -1.0;
        for (int j = k + 1; j < CLOSURE_U; j++) {
            double along = 0.0, *other = s->qr[j];
            for (int i = k; i < CLOSURE_M; i++)
                along += v[i] * other[i];
            along *= s->scale[k];
            for (int i = k; i < CLOSURE_M; i++)
                other[i] -= along * v[i];
        }
    }
}

/* Least squares D_u x = b; b is lost. */
static void CLOSURE_NAME(solve)(const CLOSURE_NAME(closed) * s, double b[CLOSURE_M],
                                double x[CLOSURE_U])
{
    for (int k = 0; k < CLOSURE_U; k++) {
        const double *v = s->qr[k];
        double along = 0.0;
        for (int i = k; i < CLOSURE_M; i++)
            along += v[i] * b[i];
        along *= s->scale[k];
        for (int i = k; i < CLOSURE_M; i++)
            b[i] -= along * v[i];
    }
    for (int k = CLOSURE_U - 1; k >= 0; k--) {
        x[k] = b[k] / s->diagonal[k];
        for (int i = 0; i < k; i++)
            b[i] -= s->qr[k][i] * x[k];
    }
}

/* A step of Newton's iteration on the unknown variables; its size. */
static double CLOSURE_NAME(step)(CLOSURE_NAME(closed) * s)
{
    double x[CLOSURE_U], size = 0.0;
    CLOSURE_AT(s->w, s->c, s->D);
    CLOSURE_NAME(factored)(s);
    CLOSURE_NAME(solve)(s, s->c, x);
    s->count++;
    for (int k = 0; k < CLOSURE_U; k++) {
        const double part = fabs(x[k]) / CLOSURE_NAME(size_u)[k];
        s->w[CLOSURE_NAME(unknown)[k]] -= x[k];
        /* NaN is kept: a comparison with it is false. */
        if (part > size || part != part)
            size = part;
    }
    return size;
}

/* Whether Newton's iteration contracts, on the branch of a sense (0: that of its first step),
 * within some steps: onto the loops, or, on the way, near them. */
static int CLOSURE_NAME(corrected)(CLOSURE_NAME(closed) * s, double sense, double contraction,
                                   int is_last)
{
    double bound = CLOSURE_FARTHEST;
    for (int k = 1; k <= CLOSURE_STEPS; k++) {
        const double size = CLOSURE_NAME(step)(s);
        if (!(size <= bound) || s->sense * sense < 0.0)
            return 0;
        sense = s->sense;
        if (size <= CLOSURE_SETTLED || (!is_last && k == CLOSURE_FEW_STEPS))
            return 1;
        bound = contraction * size;
    }
    return 0;
}

/* Whether the loops are closed; evaluates the equations. */
static int CLOSURE_NAME(is_closed)(CLOSURE_NAME(closed) * s)
{
    int is_closed = 1;
    CLOSURE_AT(s->w, s->c, s->D);
    for (int i = 0; i < CLOSURE_M; i++)
        is_closed &= fabs(s->c[i]) <= CLOSURE_CLOSED * CLOSURE_NAME(size_c)[i];
    return is_closed;
}

/* The derivative of the unknown variables along rates of the coordinates, D_u factored before. */
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

/* Follows s->w, where the loops are nearly closed, to coordinates q; whether it gets there. */
static int CLOSURE_NAME(follow)(CLOSURE_NAME(closed) * s, const double q[CLOSURE_Q], double sense,
                                double tangent[CLOSURE_U])
{
    double from[CLOSURE_W], way[CLOSURE_Q], done = 0.0, stride = 1.0;
    const double contraction = CLOSURE_M == CLOSURE_U ? CLOSURE_CONTRACTION : CLOSURE_CAREFUL;
    memcpy(from, s->w, sizeof from);
    for (int k = 0; k < CLOSURE_Q; k++)
        way[k] = q[k] - from[CLOSURE_NAME(actuated)[k]] / CLOSURE_NAME(ratio)[k];
    while (s->count < CLOSURE_MOST) {
        const int is_last = stride >= 1.0 - done;
        const double to = is_last ? 1.0 : done + stride;
        for (int k = 0; k < CLOSURE_Q; k++) {
            const double rest = (to - 1.0) * way[k];
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
            CLOSURE_NAME(slope)(s, way, tangent);
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

/* NaN in place of a configuration that is not reached. */
static void CLOSURE_NAME(reached)(CLOSURE_NAME(closed) * s, int is_reached)
{
    if (is_reached)
        return;
    for (int k = 0; k < CLOSURE_W; k++)
        s->w[k] = NAN;
    for (int i = 0; i < CLOSURE_M * CLOSURE_W; i++)
        s->D[i] = NAN;
}

/* The configuration at q, followed from the reference. */
static void CLOSURE_NAME(at)(const double q[CLOSURE_Q], CLOSURE_NAME(closed) * s)
{
    double tangent[CLOSURE_U], finite = 0.0;
    s->count = 0;
    memcpy(s->w, CLOSURE_NAME(start_w), sizeof s->w);
    for (int k = 0; k < CLOSURE_U; k++)
        tangent[k] = 0.0;
    for (int j = 0; j < CLOSURE_Q; j++) {
        const double way = q[j] - CLOSURE_NAME(start_q)[j];
        finite += 0.0 * way;
        for (int k = 0; k < CLOSURE_U; k++)
            tangent[k] += CLOSURE_NAME(tangent)[k * CLOSURE_Q + j] * way;
    }
    const int is_reached = finite == 0.0 && CLOSURE_NAME(follow)(s, q, CLOSURE_SENSE, tangent);
    CLOSURE_NAME(reached)(s, is_reached);
}

/* The configuration at q by Newton's iteration from a configuration nearby, without a way between:
 * at most CLOSURE_STEPS linear systems. */
static void CLOSURE_NAME(near)(const double q[CLOSURE_Q], CLOSURE_NAME(closed) * s)
{
    s->count = 0;
    for (int k = 0; k < CLOSURE_Q; k++)
        s->w[CLOSURE_NAME(actuated)[k]] = CLOSURE_NAME(ratio)[k] * q[k];
    const int is_reached =
        CLOSURE_NAME(corrected)(s, 0.0, CLOSURE_CONTRACTION, 1) && CLOSURE_NAME(is_closed)(s);
    CLOSURE_NAME(reached)(s, is_reached);
}

#include "chasles_closure_rates.h"

#undef CLOSURE_NAME
#undef CLOSURE_Q
#undef CLOSURE_W
#undef CLOSURE_U
#undef CLOSURE_M
#undef CLOSURE_AT
#undef CLOSURE_BEND
#undef CLOSURE_SWINGS
#undef CLOSURE_SWING
#undef CLOSURE_SENSE
#undef CLOSURE_DETERMINANT
