/* Rates and derivatives of closed loops by the implicit function theorem; part of chasles, the same
 * for every robot, included by chasles_closure.h.
 *
 *     c_w w_q = 0,   c_w wd = 0,   c_w wdd = -(c_w)' wd,   c_w (w_q)' = -(c_w)' w_q
 *
 * with the actuated rows given. D_u is factored once, at the closed configuration. */

/* (W x Q) the derivative of all variables by the coordinates. */
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

/* Rates of all variables from those of the coordinates. */
static void CLOSURE_NAME(rates)(const CLOSURE_NAME(closed) * s, const double *qd, double *wd)
{
    double x[CLOSURE_U];
    CLOSURE_NAME(slope)(s, qd, x);
    for (int k = 0; k < CLOSURE_U; k++)
        wd[CLOSURE_NAME(unknown)[k]] = x[k];
    for (int k = 0; k < CLOSURE_Q; k++)
        wd[CLOSURE_NAME(actuated)[k]] = CLOSURE_NAME(ratio)[k] * qd[k];
}

/* x = -c_u^+ bend v, the part of a second derivative that is due to the bend of the equations. */
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

/* Accelerations of all variables from those of the coordinates, and the rates wd. */
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

/* (W x Q) the rate of the derivative w_q at rates wd of all variables. */
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

/* All variables, the swings of struts behind w, and their derivatives by the coordinates. */
static void CLOSURE_NAME(all)(const CLOSURE_NAME(closed) * s, double *all)
{
    memcpy(all, s->w, sizeof s->w);
#if CLOSURE_SWINGS
    double slope[CLOSURE_SWINGS * CLOSURE_W];
    CLOSURE_SWING(s->w, all + CLOSURE_W, slope);
#endif
}

static void CLOSURE_NAME(all_D_q)(const CLOSURE_NAME(closed) * s, double *D)
{
    CLOSURE_NAME(w_D_q)(s, D);
#if CLOSURE_SWINGS
    double swing[CLOSURE_SWINGS], slope[CLOSURE_SWINGS * CLOSURE_W];
    CLOSURE_SWING(s->w, swing, slope);
    for (int i = 0; i < CLOSURE_SWINGS; i++)
        for (int j = 0; j < CLOSURE_Q; j++) {
            double sum = 0.0;
            for (int k = 0; k < CLOSURE_W; k++)
                sum += slope[i * CLOSURE_W + k] * D[k * CLOSURE_Q + j];
            D[(CLOSURE_W + i) * CLOSURE_Q + j] = sum;
        }
#endif
}

/* The square of det c_u in parts of that at the reference: 0 at a singularity, NaN out of reach. */
static double CLOSURE_NAME(margin)(CLOSURE_NAME(closed) * s)
{
    double part = 1.0 / CLOSURE_DETERMINANT;
    CLOSURE_NAME(factored)(s);
    for (int k = 0; k < CLOSURE_U; k++)
        part *= s->diagonal[k];
    return part * part;
}

/* Some rows of a table with so many columns. */
static void CLOSURE_NAME(picked)(const double *table, int columns, int count, const int *index,
                                 double *picked)
{
    for (int k = 0; k < count; k++)
        for (int j = 0; j < columns; j++)
            picked[k * columns + j] = table[index[k] * columns + j];
}

/* (6 x Q) the Jacobian by the coordinates from that by the main chain's joints, (6 x n). */
static void CLOSURE_NAME(product)(const double *J, const double *theta_q, int n, int is_sum,
                                  double *by_q)
{
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < CLOSURE_Q; j++) {
            double sum = is_sum ? by_q[i * CLOSURE_Q + j] : 0.0;
            for (int k = 0; k < n; k++)
                sum += J[i * n + k] * theta_q[k * CLOSURE_Q + j];
            by_q[i * CLOSURE_Q + j] = sum;
        }
}

/* (6 x Q x Q) the Hessian by the coordinates: the chain's own (6 x n x n) in both directions, and
 * the Jacobian times the second derivative of the joints (Q tables n x Q, one a direction). */
static void CLOSURE_NAME(hessian)(const double *H, const double *J, const double *theta_q,
                                  const double *theta_q_q, int n, double *by_q)
{
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < CLOSURE_Q; j++)
            for (int k = 0; k < CLOSURE_Q; k++) {
                double sum = 0.0;
                for (int a = 0; a < n; a++) {
                    double along = 0.0;
                    for (int b = 0; b < n; b++)
                        along += H[(i * n + a) * n + b] * theta_q[b * CLOSURE_Q + k];
                    sum += along * theta_q[a * CLOSURE_Q + j];
                    sum += J[i * n + a] * theta_q_q[(k * n + a) * CLOSURE_Q + j];
                }
                by_q[(i * CLOSURE_Q + j) * CLOSURE_Q + k] = sum;
            }
}
