/* Newton's iteration on closure equations, near a configuration with nearly closed loops. This file
 * is part of chasles and is the same for every robot. The headers chasles_closure.h and
 * chasles_closure_parametric.h include this file after the robot's macros and tables. */
#include <math.h>

#include "chasles_closure_tolerances.h"

/* A configuration w, the values c of the closure equations at w, and their derivative D.
 * Householder reflections factor D_u, the columns of D for the unknown variables, into Q R. Column
 * k of `qr` contains R above the diagonal and the reflection vector below. If the geometry is an
 * input, `p` contains the geometry parameters. */
typedef struct {
    double w[CLOSURE_W], c[CLOSURE_M], D[CLOSURE_M * CLOSURE_W];
    double qr[CLOSURE_U][CLOSURE_M], diagonal[CLOSURE_U], scale[CLOSURE_U];
    double sense;
    int count;
#ifdef CLOSURE_P
    const double *p;
#endif
} CLOSURE_NAME(closed);

/* Computes the QR factorization D_u = Q R. s->sense is the sign of det D_u, or 0 if D_u is not
 * square. */
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

/* Solves D_u x = b in the least-squares sense, and overwrites b. */
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

/* Takes a Newton step of the unknown loop variables. Returns the size of the Newton step. */
static double CLOSURE_NAME(step)(CLOSURE_NAME(closed) * s)
{
    double x[CLOSURE_U], size = 0.0;
    CLOSURE_AT(s);
    CLOSURE_NAME(factored)(s);
    CLOSURE_NAME(solve)(s, s->c, x);
    s->count++;
    for (int k = 0; k < CLOSURE_U; k++) {
        const double part = fabs(x[k]) / CLOSURE_NAME(size_u)[k];
        s->w[CLOSURE_NAME(unknown)[k]] -= x[k];
        /* A NaN step size propagates, because comparisons with NaN are false. */
        if (part > size || part != part)
            size = part;
    }
    return size;
}

/* Runs Newton's iteration. Returns 1 if the iteration converges within CLOSURE_STEPS steps and det
 * D_u keeps the sign `sense`, otherwise 0. If `sense` is 0, det D_u must keep the sign that it has
 * at the first step. At intermediate points of the path, the loops need not be closed exactly. */
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

/* Evaluates the closure equations, and returns whether the loops are closed. */
static int CLOSURE_NAME(is_closed)(CLOSURE_NAME(closed) * s)
{
    int is_closed = 1;
    CLOSURE_AT(s);
    for (int i = 0; i < CLOSURE_M; i++)
        is_closed &= fabs(s->c[i]) <= CLOSURE_CLOSED * CLOSURE_NAME(size_c)[i];
    return is_closed;
}

/* Sets the loop variables s->w and the derivative s->D to NaN if the iteration has not reached the
 * configuration. */
static void CLOSURE_NAME(reached)(CLOSURE_NAME(closed) * s, int is_reached)
{
    if (is_reached)
        return;
    for (int k = 0; k < CLOSURE_W; k++)
        s->w[k] = NAN;
    for (int i = 0; i < CLOSURE_M * CLOSURE_W; i++)
        s->D[i] = NAN;
}

/* Computes the configuration at the coordinates q by Newton's iteration from a nearby
 * configuration, without intermediate points. This function solves at most CLOSURE_STEPS linear
 * systems. */
static void CLOSURE_NAME(near)(const double q[CLOSURE_Q], CLOSURE_NAME(closed) * s)
{
    s->count = 0;
    for (int k = 0; k < CLOSURE_Q; k++)
        s->w[CLOSURE_NAME(actuated)[k]] = CLOSURE_NAME(ratio)[k] * q[k];
    const int is_reached =
        CLOSURE_NAME(corrected)(s, 0.0, CLOSURE_CONTRACTION, 1) && CLOSURE_NAME(is_closed)(s);
    CLOSURE_NAME(reached)(s, is_reached);
}
