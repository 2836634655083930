/* Solves the linear equations of a damped Newton step, with one configuration per SIMD lane. This
 * file is part of chasles and is the same for every robot. The header chasles_polish.h includes
 * this file once for each robot. */
#if POLISH_N >= 6 && POLISH_IS_SEARCHED
/* Inverts a symmetric 3 x 3 block in place, given its lower half, and updates the two smallest
 * pivots found so far. */
POLISH_INLINE void POLISH_NAME(inverted)(lanes (*a)[6], int at, lanes *pivots)
{
    lanes *r0 = a[at] + at, *r1 = a[at + 1] + at, *r2 = a[at + 2] + at;
    const lanes c00 = r1[1] * r2[2] - r2[1] * r2[1], c10 = r2[1] * r2[0] - r1[0] * r2[2];
    const lanes c20 = r1[0] * r2[1] - r1[1] * r2[0], c11 = r0[0] * r2[2] - r2[0] * r2[0];
    const lanes c21 = r1[0] * r2[0] - r0[0] * r2[1], c22 = r0[0] * r1[1] - r1[0] * r1[0];
    const lanes determinant = r0[0] * c00 + r1[0] * c10 + r2[0] * c20;
    const lanes scale = 1.0 / determinant;
    const lanes pivot[3] = {r0[0], c22 / r0[0], determinant / c22};
    POLISH_UNROLL
    for (int i = 0; i < 3; i++) {
        const lanes greater = POLISH_MAX(pivots[0], pivot[i]);
        pivots[0] = POLISH_MIN(pivots[0], pivot[i]);
        pivots[1] = POLISH_MIN(pivots[1], greater);
    }
    r0[0] = c00 * scale;
    r1[0] = c10 * scale, r1[1] = c11 * scale;
    r2[0] = c20 * scale, r2[1] = c21 * scale, r2[2] = c22 * scale;
}

/* Multiplies a symmetric 3 x 3 block, of which only the lower half is stored, by a vector. */
POLISH_INLINE void POLISH_NAME(times)(lanes (*a)[6], int at, const lanes *x, lanes *y)
{
    const lanes *r0 = a[at] + at, *r1 = a[at + 1] + at, *r2 = a[at + 2] + at;
    y[0] = r0[0] * x[0] + r1[0] * x[1] + r2[0] * x[2];
    y[1] = r1[0] * x[0] + r1[1] * x[1] + r2[1] * x[2];
    y[2] = r2[0] * x[0] + r2[1] * x[1] + r2[2] * x[2];
}

/* Solves the factored linear equations for one more right-hand side. */
POLISH_INLINE void POLISH_NAME(solve_again)(lanes a[6][6], lanes *b)
{
    lanes x[3], y[3];
    POLISH_NAME(times)(a, 0, b, x);
    POLISH_UNROLL
    for (int i = 0; i < 3; i++)
        y[i] = b[3 + i] - (a[3 + i][0] * b[0] + a[3 + i][1] * b[1] + a[3 + i][2] * b[2]);
    POLISH_NAME(times)(a, 3, y, b + 3);
    POLISH_UNROLL
    for (int k = 0; k < 3; k++)
        b[k] = x[k] - (a[3][k] * b[3] + a[4][k] * b[4] + a[5][k] * b[5]);
}

/* Solves the symmetric system a x = b for several right-hand sides b; x replaces b. The matrix a is
 * stored as its lower half. Updates the two smallest pivots, which are squared lengths. */
POLISH_INLINE void POLISH_NAME(solve)(lanes a[6][6], lanes (*b)[6], int sides, lanes *pivots)
{
    lanes L[3][3];
    POLISH_NAME(inverted)(a, 0, pivots);
    POLISH_UNROLL
    for (int i = 0; i < 3; i++) {
        memcpy(L[i], a[3 + i], sizeof L[i]);
        POLISH_NAME(times)(a, 0, L[i], a[3 + i]);
    }
    POLISH_UNROLL
    for (int i = 0; i < 3; i++) {
        POLISH_UNROLL
        for (int j = 0; j <= i; j++)
            a[3 + i][3 + j] -=
                a[3 + i][0] * L[j][0] + a[3 + i][1] * L[j][1] + a[3 + i][2] * L[j][2];
    }
    POLISH_NAME(inverted)(a, 3, pivots);
    for (int m = 0; m < sides; m++)
        POLISH_NAME(solve_again)(a, b[m]);
}

/* Computes the trace of the inverse of the factored matrix. */
POLISH_INLINE void POLISH_NAME(inverse_trace)(lanes a[6][6], lanes *trace)
{
    *trace = a[0][0] + a[1][1] + a[2][2] + a[3][3] + a[4][4] + a[5][5];
    POLISH_UNROLL
    for (int k = 0; k < 3; k++) {
        const lanes x[3] = {a[3][k], a[4][k], a[5][k]};
        lanes y[3];
        POLISH_NAME(times)(a, 3, x, y);
        *trace += x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    }
}
#else
/* Solves the symmetric system a x = b for several right-hand sides b; x replaces b. The matrix a is
 * stored as its lower half. Updates the two smallest pivots, which are squared lengths. */
POLISH_INLINE void POLISH_NAME(solve)(lanes a[POLISH_ROWS][POLISH_ROWS], lanes (*b)[POLISH_ROWS],
                                      int sides, lanes *pivots)
{
    /* After the factorization a = L D L^T, the lower half of `a` contains L D, the upper half L^T,
     * and the diagonal 1 / D. */
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

/* Solves the factored linear equations for one more right-hand side. */
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

#endif

#if POLISH_N >= 6
/* Computes the lower half of J J^T and adds `added` to the diagonal. */
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

/* Computes the matrix of the damped step: J J^T (six or more coordinates) or J^T J (fewer
 * coordinates), with `added` added to each diagonal entry. */
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

/* Computes the right-hand side of the step equations for a twist e. */
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

/* Computes the step dq from the solution of the step equations. */
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
