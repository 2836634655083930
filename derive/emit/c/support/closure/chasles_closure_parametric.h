/* Solves kinematic loops whose geometry parameters p are an input. Newton's iteration from the
 * nominal configuration closes the loops. Further functions compute derivatives of the tool pose.
 * This file is part of chasles and is the same for every robot.
 *
 * This file is included once for each robot, which defines the following macros and tables.
 *
 *   CLOSURE_NAME(name)         is the name of a function or table of the robot.
 *   CLOSURE_Q, CLOSURE_W       are the numbers of coordinates q and of loop variables w = (q, u).
 *   CLOSURE_U, CLOSURE_M       are the numbers of unknown variables u and of equations (M = U).
 *   CLOSURE_P                  is the number of geometry parameters.
 *   CLOSURE_AT(s)              computes the equations s->c and their derivative s->D at s->w
 *                              and s->p.
 *   CLOSURE_Z                  is the number of entries of the nominal configuration z.
 *   CLOSURE_CONFIGURATION(q, z)      computes z at q, or NaN if the nominal loops do not close.
 *   Table actuated             contains the variable of each coordinate.
 *   Table ratio                contains the value 1 for each coordinate.
 *   Table unknown              contains the indices of the unknown variables.
 *   Table of_z                 contains the index in z of each unknown variable.
 *   Tables size_u, size_c      contain the scales of unknowns and equations: a length (meter) or 1.
 *
 * The code allocates nothing and has no state. */
#include <string.h>

#include "chasles_closure_newton.h"

/* Computes the loop variables w at the coordinates q for the geometry parameters p. */
static void CLOSURE_NAME(at)(CLOSURE_NAME(closed) * s, const double q[CLOSURE_Q],
                             const double p[CLOSURE_P], double w[CLOSURE_W])
{
    double z[CLOSURE_Z];
    CLOSURE_CONFIGURATION(q, z);
    s->p = p;
    for (int k = 0; k < CLOSURE_U; k++)
        s->w[CLOSURE_NAME(unknown)[k]] = z[CLOSURE_NAME(of_z)[k]];
    CLOSURE_NAME(near)(q, s);
    memcpy(w, s->w, sizeof s->w);
}

/* Computes L = J_u c_u^-1 (6 x M), where J_u and c_u are the derivatives of tool pose and closure
 * equations by the unknown variables. The columns of J_u are columns of the tool's Jacobian J (6 x
 * W). */
static void CLOSURE_NAME(levers)(CLOSURE_NAME(closed) * s, const double *J, double *L)
{
    CLOSURE_NAME(factored)(s);
    for (int row = 0; row < 6; row++) {
        double *l = L + row * CLOSURE_M;
        for (int k = 0; k < CLOSURE_U; k++) {
            double rest = J[row * CLOSURE_W + CLOSURE_NAME(unknown)[k]];
            for (int i = 0; i < k; i++)
                rest -= s->qr[k][i] * l[i];
            l[k] = rest / s->diagonal[k];
        }
        for (int k = CLOSURE_U - 1; k >= 0; k--) {
            const double *v = s->qr[k];
            double along = 0.0;
            for (int i = k; i < CLOSURE_M; i++)
                along += v[i] * l[i];
            along *= s->scale[k];
            for (int i = k; i < CLOSURE_M; i++)
                l[i] -= along * v[i];
        }
    }
}

/* Computes J = J_x - L c_x for the first `columns` columns of J_x and c_x. Rows of J_x and c_x have
 * `width` entries. */
static void CLOSURE_NAME(through)(const double *J_x, const double *L, const double *c_x, int width,
                                  int columns, double *J)
{
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < columns; j++) {
            double sum = J_x[i * width + j];
            for (int k = 0; k < CLOSURE_M; k++)
                sum -= L[i * CLOSURE_M + k] * c_x[k * width + j];
            J[i * columns + j] = sum;
        }
}

/* Converts the tool's Jacobian J_w with respect to the loop variables w to the Jacobian (6 x Q)
 * with respect to the coordinates. */
static void CLOSURE_NAME(by_q)(const CLOSURE_NAME(closed) * s, const double *J_w, const double *L,
                               double *J)
{
    CLOSURE_NAME(through)(J_w, L, s->D, CLOSURE_W, CLOSURE_Q, J);
}

/* Computes the tool's Jacobian (6 x P) with respect to the geometry parameters. The argument J_p is
 * the same Jacobian at constant loop variables w. */
static void CLOSURE_NAME(by_p)(const CLOSURE_NAME(closed) * s, const double *J_p, const double *L,
                               const double *c_p, double *J)
{
    (void)s;
    CLOSURE_NAME(through)(J_p, L, c_p, CLOSURE_P, CLOSURE_P, J);
}

/* Converts mixed twists (6 x P) to space twists. */
static void CLOSURE_NAME(in_space)(const CLOSURE_NAME(closed) * s, const double T[16], double *J)
{
    (void)s;
    for (int j = 0; j < CLOSURE_P; j++) {
        double *v = J + j;
        const double *omega = J + 3 * CLOSURE_P + j;
        for (int i = 0; i < 3; i++) {
            const int a = (i + 1) % 3, b = (i + 2) % 3;
            v[i * CLOSURE_P] +=
                T[4 * a + 3] * omega[b * CLOSURE_P] - T[4 * b + 3] * omega[a * CLOSURE_P];
        }
    }
}

/* Converts mixed twists (6 x P) to body twists, in tool axes. */
static void CLOSURE_NAME(in_body)(const CLOSURE_NAME(closed) * s, const double T[16], double *J)
{
    (void)s;
    for (int j = 0; j < 2 * CLOSURE_P; j++) {
        double *x = J + (j < CLOSURE_P ? j : 2 * CLOSURE_P + j);
        const double base[3] = {x[0], x[CLOSURE_P], x[2 * CLOSURE_P]};
        for (int i = 0; i < 3; i++)
            x[i * CLOSURE_P] = T[i] * base[0] + T[4 + i] * base[1] + T[8 + i] * base[2];
    }
}

#undef CLOSURE_NAME
#undef CLOSURE_Q
#undef CLOSURE_W
#undef CLOSURE_U
#undef CLOSURE_M
#undef CLOSURE_P
#undef CLOSURE_AT
#undef CLOSURE_Z
#undef CLOSURE_CONFIGURATION
