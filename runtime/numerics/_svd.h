/* Singular value decomposition of a Jacobian with six rows. */
#pragma once

#include "numerics/_vectors.h"

/* J = sum over i of sigma[i] u[i] v[i]^T, the largest singular value first. */
typedef struct {
    int n;     /* columns of J */
    int count; /* singular values, min(6, n) */
    double sigma[TWIST];
    double u[TWIST][TWIST];
    double *v;    /* (6, n) */
    double *work; /* (6, max(6, n)) */
} Svd;

/* Computes the singular value decomposition of the Jacobian J (6, n). A column k of J with
 * removed[k] != 0 counts as zero, and column k of v is then zero. The caller owns the memory of v
 * and work. */
void svd_decompose(Svd *svd, const double *J, const char *removed);
