/* Checks the solver functions that robots share, with pseudorandom numbers and limit cases. Prints
 * the number of checked cases. With the argument `solve`, the program tests symmetric linear
 * systems of every size up to 8. With the argument `decompose`, the program tests singular values
 * and vectors, also for rank-deficient matrices. With the argument `logarithm`, the program tests
 * rotations by angles from 0 to pi. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "numerics/_linear_solve.h"
#include "numerics/_logarithm.h"
#include "numerics/_svd.h"

#define LARGEST 8
#define CASES 200
#define TOLERANCE 1e-10
#define SHARP 1e-12

static void require(int condition, const char *what, int index)
{
    if (!condition) {
        fprintf(stderr, "%s: case %d\n", what, index);
        exit(2);
    }
}

/* Returns entry k of the given row of a table of pseudorandom numbers in [-1, 1]. */
static double scattered(int row, int k)
{
    unsigned long value = ((unsigned long)row * 131 + (unsigned long)k * 17 + 7) * 2654435761UL;
    return (double)(value >> 8 & 0xffff) / 0x8000 - 1;
}

/* ------------------------------------------------------------------ linear systems */

/* Tests |A x - b| <= TOLERANCE for a symmetric matrix A (m, m). Consecutive rows of A are `stride`
 * doubles apart. */
static int solves(const double *A, int m, int stride, const double *x, const double *b)
{
    for (int i = 0; i < m; i++) {
        double sum = -b[i];
        for (int j = 0; j < m; j++) {
            sum += A[i * stride + j] * x[j];
        }
        if (!(fabs(sum) <= TOLERANCE)) {
            return 0;
        }
    }
    return 1;
}

static int check_symmetric(int row, int m)
{
    double A[LARGEST * LARGEST], work[LARGEST * LARGEST], dense[LARGEST * LARGEST];
    double b[LARGEST], x[LARGEST];
    for (int i = 0; i < m; i++) {
        b[i] = scattered(row, 90 + i);
        for (int j = 0; j < m; j++) {
            double sum = i == j;
            for (int k = 0; k < m; k++) {
                sum += scattered(row, 8 * i + k) * scattered(row, 8 * j + k);
            }
            A[i * LARGEST + j] = dense[i * m + j] = sum;
        }
    }
    memcpy(work, dense, sizeof work);
    memcpy(x, b, sizeof x);
    solve_symmetric(work, m, m, x);
    require(solves(A, m, LARGEST, x, b), "solve_symmetric of dense rows", row);
    memcpy(work, A, sizeof work);
    memcpy(x, b, sizeof x);
    solve_symmetric(work, m, LARGEST, x);
    require(solves(A, m, LARGEST, x, b), "solve_symmetric", row);
    return 2;
}

static int check_solve(void)
{
    int checked = 0;
    for (int row = 0; row < CASES; row++) {
        checked += check_symmetric(row, 1 + row % LARGEST);
    }
    return checked;
}

/* ------------------------------------------------------------------ singular values */

static int check_svd(int row, int n, int rank, int remove)
{
    double J[TWIST * LARGEST], v[TWIST * LARGEST], work[TWIST * LARGEST];
    char removed[LARGEST] = {0};
    Svd svd = {.n = n, .v = v, .work = work};
    removed[n - 1] = remove;
    for (int a = 0; a < TWIST; a++) {
        for (int k = 0; k < n; k++) {
            J[a * n + k] = 0;
            for (int i = 0; i < rank; i++) {
                J[a * n + k] += scattered(row, 6 * i + a) * scattered(row + 1, 8 * i + k);
            }
        }
    }
    svd_decompose(&svd, J, removed);
    require(svd.count == (n < TWIST ? n : TWIST), "count", row);
    for (int a = 0; a < TWIST; a++) {
        for (int k = 0; k < n; k++) {
            double rest = removed[k] ? 0 : -J[a * n + k];
            for (int i = 0; i < svd.count; i++) {
                rest += svd.sigma[i] * svd.u[i][a] * svd.v[i * n + k];
            }
            require(fabs(rest) <= SHARP, "J = sum of sigma u v^T", row);
        }
    }
    int full = n - remove < svd.count ? n - remove : svd.count;
    for (int i = 0; i < svd.count; i++) {
        require(i == 0 || svd.sigma[i] <= svd.sigma[i - 1], "order of singular values", row);
        require(i < rank || svd.sigma[i] <= SHARP, "rank", row);
        for (int j = 0; j <= i && i < full; j++) {
            double uu = dot(svd.u[i], svd.u[j], TWIST), vv = dot(v + i * n, v + j * n, n);
            require(fabs(uu - (i == j)) <= SHARP, "orthonormal u", row);
            require(fabs(vv - (i == j)) <= SHARP, "orthonormal v", row);
        }
    }
    return 1;
}

static int check_decompose(void)
{
    int checked = 0;
    for (int row = 0; row < CASES; row++) {
        int n = 1 + row % LARGEST, most = n < TWIST ? n : TWIST;
        checked += check_svd(row, n, most, 0);
        checked += check_svd(row, n, 1 + row % most, 0);
        checked += n > 1 ? check_svd(row, n, most, 1) : 0;
    }
    return checked;
}

/* ------------------------------------------------------------------ logarithm */

/* Writes the exponential T (4, 4) of a twist (v, w), by Rodrigues's formula and the integral of the
 * rotation. */
static void exponential(const double *twist, double *T)
{
    const double *v = twist, *w = twist + 3;
    double angle = sqrt(dot3(w, w)), small = angle < 1e-3, square = angle * angle;
    double a = small ? 1 - square / 6 : sin(angle) / angle;
    double b = small ? 0.5 - square / 24 : 2 * sin(angle / 2) * sin(angle / 2) / square;
    double c = small ? 1.0 / 6 - square / 120 : (angle - sin(angle)) / (square * angle);
    double p[3], wv[3], wwv[3];
    cross(w, v, wv);
    cross(w, wv, wwv);
    for (int i = 0; i < 3; i++) {
        p[i] = v[i] + b * wv[i] + c * wwv[i];
    }
    for (int j = 0; j < 3; j++) {
        double x[3] = {j == 0, j == 1, j == 2}, wx[3], wwx[3];
        cross(w, x, wx);
        cross(w, wx, wwx);
        for (int i = 0; i < 3; i++) {
            T[4 * i + j] = x[i] + a * wx[i] + b * wwx[i];
        }
    }
    for (int i = 0; i < 4; i++) {
        T[12 + i] = i == 3;
        T[4 * i + 3] = i < 3 ? p[i] : 1;
    }
}

/* Tests twist_between, which computes the twist (v, w) from a pose A to a pose B, at the origin a
 * of A. The test pose A is a pure translation. At the base origin, the same twist has the linear
 * part v - w x a. */
static int check_twist(int row, double angle)
{
    double axis[3], twist[TWIST], found[TWIST], displacement[TWIST], at_base[TWIST], E[POSE];
    double A[POSE] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, B[POSE], moved[3], wa[3];
    for (int i = 0; i < 3; i++) {
        axis[i] = scattered(row, i);
        twist[i] = scattered(row, 3 + i);
        A[4 * i + 3] = scattered(row, 6 + i);
    }
    double size = sqrt(dot3(axis, axis)), a[3] = {A[3], A[7], A[11]};
    for (int i = 0; i < 3; i++) {
        twist[3 + i] = angle * axis[i] / size;
    }
    cross(twist + 3, a, wa);
    memcpy(at_base, twist, sizeof at_base);
    for (int i = 0; i < 3; i++) {
        at_base[i] -= wa[i];
    }
    exponential(at_base, E);
    memcpy(B, E, sizeof B);
    rotate(E, a, moved);
    for (int i = 0; i < 3; i++) {
        B[4 * i + 3] = E[4 * i + 3] + moved[i];
    }
    twist_between(A, B, found);
    RotationAngle rotation = displacement_between(A, B, displacement);
    require(fabs(rotation.angle - angle) <= SHARP, "angle", row);
    for (int i = 0; i < TWIST; i++) {
        require(fabs(found[i] - twist[i]) <= TOLERANCE, "twist_between", row);
    }
    for (int i = 0; i < 3; i++) {
        require(displacement[i] == B[4 * i + 3] - A[4 * i + 3], "displacement_between", row);
        require(fabs(displacement[3 + i] - twist[3 + i]) <= SHARP, "rotation vector", row);
    }
    return 1;
}

static int check_logarithm(void)
{
    static const double near[] = {1e-12, 1e-8, 1e-5, 9e-5, 1.1e-4, 1e-3};
    const double pi = acos(-1.0);
    int checked = 0;
    for (int row = 0; row < CASES; row++) {
        int k = row % 6;
        checked += check_twist(row, pi * row / CASES);
        checked += check_twist(row, near[k]);
        checked += check_twist(row, pi - near[k]);
    }
    return checked;
}

int main(int count, char **words)
{
    const char *mode = count == 2 ? words[1] : "";
    if (strcmp(mode, "solve") == 0) {
        printf("%d\n", check_solve());
    } else if (strcmp(mode, "decompose") == 0) {
        printf("%d\n", check_decompose());
    } else {
        printf("%d\n", check_logarithm());
    }
    return 0;
}
