#include "numerics/_svd.h"

#include <math.h>
#include <string.h>

#include "numerics/_orthogonal.h"
#include "numerics/_tolerances.h"

/* Tests whether two rows are orthogonal, up to the rounding error of the matrix. */
static int has_right_angle(double aa, double bb, double ab, double total)
{
    return !(fabs(ab) > SVD_ORTHOGONAL * (sqrt(aa * bb) + SVD_ORTHOGONAL * total));
}

/* Returns the coordinate axis with the longest component normal to `count` orthonormal vectors
 * (stride m), or -1 if all axes are marked in `removed`. Writes the squared length to *square. */
static int find_longest_axis(const double *others, int count, int m, const char *removed,
                             double *square)
{
    int best = -1;
    *square = -1;
    for (int k = 0; k < m; k++) {
        double left = removed && removed[k] ? -1 : 1;
        for (int i = 0; i < count; i++) {
            left -= others[i * m + k] * others[i * m + k];
        }
        if (left > *square) {
            *square = left;
            best = k;
        }
    }
    return best;
}

/* Writes a unit vector x (m,) that is orthogonal to `count` vectors. Components that are marked in
 * `removed` are zero. If no such vector exists, x is 0. */
static void complete_basis(double *x, const double *others, int count, int m, const char *removed)
{
    double square;
    int axis = find_longest_axis(others, count, m, removed, &square);
    memset(x, 0, m * sizeof *x);
    if (axis < 0 || square < SVD_NOTHING_LEFT) {
        return;
    }
    x[axis] = 1;
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < count; i++) {
            double along = dot(x, others + i * m, m);
            for (int k = 0; k < m; k++) {
                x[k] -= along * others[i * m + k];
            }
        }
    }
    double size = sqrt(dot(x, x, m));
    for (int k = 0; k < m; k++) {
        x[k] /= size;
    }
}

static void sort_rows(const double *W, int p, int m, double *length, int *order)
{
    for (int i = 0; i < p; i++) {
        length[i] = sqrt(dot(W + i * m, W + i * m, m));
        int j = i;
        for (; j > 0 && length[order[j - 1]] < length[i]; j--) {
            order[j] = order[j - 1];
        }
        order[j] = i;
    }
}

void svd_decompose(Svd *svd, const double *J, const char *removed)
{
    int n = svd->n, wide = n >= TWIST, p = wide ? TWIST : n, m = wide ? n : TWIST;
    double *W = svd->work, Y[TWIST][TWIST] = {{0}}, length[TWIST];
    int order[TWIST];
    for (int a = 0; a < TWIST; a++) {
        for (int k = 0; k < n; k++) {
            W[wide ? a * m + k : k * m + a] = removed[k] ? 0 : J[a * n + k];
        }
    }
    for (int i = 0; i < p; i++) {
        Y[i][i] = 1;
    }
    orthogonalize_rows(W, p, m, Y[0], TWIST, has_right_angle, dot(W, W, p * m));
    sort_rows(W, p, m, length, order);
    double sorted[TWIST * TWIST];
    double *longer = wide ? svd->v : sorted;
    svd->count = p;
    for (int i = 0; i < p; i++) {
        const double *from = W + order[i] * m;
        double sigma = length[order[i]], *to = longer + i * m;
        svd->sigma[i] = sigma;
        if (sigma <= SVD_NULL * svd->sigma[0]) {
            complete_basis(to, longer, i, m, wide ? removed : NULL);
            continue;
        }
        for (int k = 0; k < m; k++) {
            to[k] = from[k] / sigma;
        }
    }
    for (int i = 0; i < p; i++) {
        for (int a = 0; a < TWIST; a++) {
            svd->u[i][a] = wide ? Y[order[i]][a] : sorted[i * TWIST + a];
        }
        for (int k = 0; k < n && !wide; k++) {
            svd->v[i * n + k] = Y[order[i]][k];
        }
    }
}
