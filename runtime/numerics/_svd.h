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

/* Decomposes the Jacobian J (6, n). Columns k with removed[k] != 0 count as zero, and so do these
 * components of v. The caller owns the memory of v and work. */
void svd_decompose(Svd *svd, const double *J, const char *removed);
