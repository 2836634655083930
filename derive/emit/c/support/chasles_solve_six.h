/* Solves six linear equations and computes their determinant. This file is part of chasles and is
 * the same for every robot. */
#ifndef CHASLES_SOLVE_SIX_H
#define CHASLES_SOLVE_SIX_H

#include <math.h>

/* Solves six linear equations for x. In the matrix `a` (6 x 7), the first six columns are the
 * coefficients and the last column is the right-hand side. The function overwrites the matrix `a`.
 * Returns the determinant of the coefficient matrix. The determinant is 0 if the coefficient matrix
 * is singular. */
static double chasles_solve_six(double (*a)[7], double *x)
{
    double determinant = 1.0;
    for (int j = 0; j < 6; j++) {
        int p = j;
        for (int i = j + 1; i < 6; i++) {
            if (fabs(a[i][j]) > fabs(a[p][j]))
                p = i;
        }
        if (!(fabs(a[p][j]) > 0.0))
            return 0.0;
        if (p != j) {
            determinant = -determinant;
            for (int k = 0; k < 7; k++) {
                const double kept = a[p][k];
                a[p][k] = a[j][k], a[j][k] = kept;
            }
        }
        determinant *= a[j][j];
        const double inverse = 1.0 / a[j][j];
        for (int i = j + 1; i < 6; i++) {
            const double factor = a[i][j] * inverse;
            for (int k = j; k < 7; k++)
                a[i][k] -= factor * a[j][k];
        }
    }
    for (int j = 5; j >= 0; j--) {
        double sum = a[j][6];
        for (int k = j + 1; k < 6; k++)
            sum -= a[j][k] * x[k];
        x[j] = sum / a[j][j];
    }
    return determinant;
}

#endif
