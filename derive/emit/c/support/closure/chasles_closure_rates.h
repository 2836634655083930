/* Computes rates and derivatives of closed loops by the implicit function theorem. This file is
 * part of chasles and is the same for every robot. chasles_closure.h includes
 * chasles_closure_rates.h.
 *
 * Differentiating the closure equations c(w) = 0 gives c_w w_q = 0, c_w wd = 0, c_w wdd = -(c_w)'
 * wd and c_w (w_q)' = -(c_w)' w_q. In w_q, wd and their derivatives, the rows of the actuated
 * variables are known, and the equations determine the other rows. D_u, the columns of c_w for the
 * unknown variables, are factored only once, in a configuration with closed loops. */

/* Computes the derivative (W x Q) of all loop variables with respect to the coordinates. */
static void CLOSURE_NAME(w_D_q)(const CLOSURE_NAME(closed) * s, double *D)
{
    for (int j = 0; j < CLOSURE_Q; j++) {
        double qd[CLOSURE_Q] = {0.0}, x[CLOSURE_U];
        qd[j] = 1.0;
        CLOSURE_NAME(slope)(s, qd, x);
        for (int k = 0; k < CLOSURE_U; k++)
            D[CLOSURE_NAME(unknown)[k] * CLOSURE_Q + j] = x[k];
        for (int k = 0; k < CLOSURE_Q; k++)
            D[CLOSURE_NAME(actuated)[k] * CLOSURE_Q + j] = k == j ? CLOSURE_NAME(ratio)[k] : 0.0;
    }
}

/* Computes the rates of all loop variables from the coordinate rates. */
static void CLOSURE_NAME(rates)(const CLOSURE_NAME(closed) * s, const double *qd, double *wd)
{
    double x[CLOSURE_U];
    CLOSURE_NAME(slope)(s, qd, x);
    for (int k = 0; k < CLOSURE_U; k++)
        wd[CLOSURE_NAME(unknown)[k]] = x[k];
    for (int k = 0; k < CLOSURE_Q; k++)
        wd[CLOSURE_NAME(actuated)[k]] = CLOSURE_NAME(ratio)[k] * qd[k];
}

static void CLOSURE_NAME(bent)(const CLOSURE_NAME(closed) * s, const double *bend, const double *v,
                               int step, double x[CLOSURE_U])
{
    double b[CLOSURE_M];
    for (int i = 0; i < CLOSURE_M; i++) {
        b[i] = 0.0;
        for (int k = 0; k < CLOSURE_W; k++)
            b[i] -= bend[i * CLOSURE_W + k] * v[k * step];
    }
    CLOSURE_NAME(solve)(s, b, x);
}

/* Computes the accelerations of all loop variables from the coordinate accelerations and the rates
 * wd of the loop variables. */
static void CLOSURE_NAME(accelerations)(const CLOSURE_NAME(closed) * s, const double *wd,
                                        const double *qdd, double *wdd)
{
    double bend[CLOSURE_M * CLOSURE_W], x[CLOSURE_U];
    CLOSURE_BEND(s->w, wd, bend);
    CLOSURE_NAME(bent)(s, bend, wd, 1, x);
    CLOSURE_NAME(rates)(s, qdd, wdd);
    for (int k = 0; k < CLOSURE_U; k++)
        wdd[CLOSURE_NAME(unknown)[k]] += x[k];
}

/* Computes the time derivative of the matrix w_q = dw/dq (W x Q) at the rates wd of the loop
 * variables w. */
static void CLOSURE_NAME(w_D_q_dot)(const CLOSURE_NAME(closed) * s, const double *wd,
                                    const double *w_q, double *D)
{
    double bend[CLOSURE_M * CLOSURE_W], x[CLOSURE_U];
    CLOSURE_BEND(s->w, wd, bend);
    for (int j = 0; j < CLOSURE_Q; j++) {
        CLOSURE_NAME(bent)(s, bend, w_q + j, CLOSURE_Q, x);
        for (int k = 0; k < CLOSURE_U; k++)
            D[CLOSURE_NAME(unknown)[k] * CLOSURE_Q + j] = x[k];
        for (int k = 0; k < CLOSURE_Q; k++)
            D[CLOSURE_NAME(actuated)[k] * CLOSURE_Q + j] = 0.0;
    }
}

/* Computes the derivative (Q x W x Q) of the matrix w_q = dw/dq with respect to each coordinate. */
static void CLOSURE_NAME(w_D_q_q)(const CLOSURE_NAME(closed) * s, const double *w_q, double *D)
{
    for (int k = 0; k < CLOSURE_Q; k++) {
        double wd[CLOSURE_W];
        for (int i = 0; i < CLOSURE_W; i++)
            wd[i] = w_q[i * CLOSURE_Q + k];
        CLOSURE_NAME(w_D_q_dot)(s, wd, w_q, D + k * CLOSURE_W * CLOSURE_Q);
    }
}

/* Writes the margin of the loops: the square of the ratio between det c_u and its value at the
 * reference configuration. The margin is 0 at a singularity, and NaN if the loops cannot be closed.
 */
static void CLOSURE_NAME(margin)(const CLOSURE_NAME(closed) * s, double *margin)
{
    double part = 1.0 / CLOSURE_DETERMINANT;
    for (int k = 0; k < CLOSURE_U; k++)
        part *= s->diagonal[k];
    *margin = part * part;
}
