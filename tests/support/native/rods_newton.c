/* Newton's iteration for platform poses with given lengths of six rods, from many start poses. */
#include <math.h>

enum { RODS = 6, MAX_STEPS = 60 };
static const double LONGEST_STEP = 0.5;
/* Number that is added to diagonal entries, so that singular linear systems become solvable. */
static const double NOISE = 1e-12;

/* Rotates a vector by a unit quaternion. */
static void turn(const double e[4], const double b[3], double r[3])
{
    const double *v = e + 1;
    const double x[3] = {v[1] * b[2] - v[2] * b[1], v[2] * b[0] - v[0] * b[2],
                         v[0] * b[1] - v[1] * b[0]};
    r[0] = b[0] + 2 * (e[0] * x[0] + v[1] * x[2] - v[2] * x[1]);
    r[1] = b[1] + 2 * (e[0] * x[1] + v[2] * x[0] - v[0] * x[2]);
    r[2] = b[2] + 2 * (e[0] * x[2] + v[0] * x[1] - v[1] * x[0]);
}

/* Writes the rod length errors, and the derivatives of the rod lengths with respect to a platform
 * twist, into A. Returns the largest length error. */
static double linear_system(const double *a, const double *b, const double *lengths,
                            const double *e, const double *p, double A[RODS][RODS + 1])
{
    double worst = 0;
    for (int i = 0; i < RODS; i++) {
        double r[3], n[3], square = 0;
        turn(e, b + 3 * i, r);
        for (int k = 0; k < 3; k++) {
            n[k] = p[k] + r[k] - a[3 * i + k];
            square += n[k] * n[k];
        }
        const double distance = sqrt(square);
        for (int k = 0; k < 3; k++) {
            n[k] /= distance;
            A[i][k] = n[k];
        }
        A[i][3] = r[1] * n[2] - r[2] * n[1];
        A[i][4] = r[2] * n[0] - r[0] * n[2];
        A[i][5] = r[0] * n[1] - r[1] * n[0];
        A[i][6] = lengths[i] - distance;
        worst = fmax(worst, fabs(A[i][6]));
        A[i][i] += NOISE;
    }
    return worst;
}

/* Solves linear equations by Gaussian elimination with pivoting. The last column of A contains the
 * right-hand side, and receives the solution. */
static void solve(double A[RODS][RODS + 1])
{
    for (int k = 0; k < RODS; k++) {
        int pivot = k;
        for (int i = k + 1; i < RODS; i++)
            if (fabs(A[i][k]) > fabs(A[pivot][k]))
                pivot = i;
        for (int j = k; j <= RODS; j++) {
            const double kept = A[k][j];
            A[k][j] = A[pivot][j];
            A[pivot][j] = kept;
        }
        for (int i = k + 1; i < RODS; i++) {
            const double part = A[i][k] / A[k][k];
            for (int j = k + 1; j <= RODS; j++)
                A[i][j] -= part * A[k][j];
        }
    }
    for (int k = RODS - 1; k >= 0; k--) {
        for (int j = k + 1; j < RODS; j++)
            A[k][RODS] -= A[k][j] * A[j][RODS];
        A[k][RODS] /= A[k][k];
    }
}

/* Moves a pose (quaternion e, position p) by the twist in the last column of A, scaled down if an
 * entry exceeds LONGEST_STEP. */
static void move(double A[RODS][RODS + 1], double e[4], double p[3])
{
    double largest = 0, s[RODS];
    for (int i = 0; i < RODS; i++)
        largest = fmax(largest, fabs(A[i][RODS]));
    const double part = largest > LONGEST_STEP ? LONGEST_STEP / largest : 1;
    for (int i = 0; i < RODS; i++)
        s[i] = part * A[i][RODS];
    for (int k = 0; k < 3; k++)
        p[k] += s[k];
    const double *h = s + 3;
    const double t[4] = {e[0] - (h[0] * e[1] + h[1] * e[2] + h[2] * e[3]) / 2,
                         e[1] + (h[0] * e[0] + h[1] * e[3] - h[2] * e[2]) / 2,
                         e[2] + (h[1] * e[0] + h[2] * e[1] - h[0] * e[3]) / 2,
                         e[3] + (h[2] * e[0] + h[0] * e[2] - h[1] * e[1]) / 2};
    const double norm = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2] + t[3] * t[3]);
    for (int k = 0; k < 4; k++)
        e[k] = t[k] / norm;
}

/*
 * Finds poses at which six rods have specified lengths, from many start poses.
 *
 * `a`, `b`:   Rod ends (6, 3) on the ground, and on the platform in platform axes.
 * `lengths`:  Rod lengths (6,).
 * `count`:    Number of start poses.
 * `e`, `p`:   Unit quaternions (count, 4) and positions (count, 3) of the start poses. Results
 *             overwrite the start poses.
 * `closes`:   Length error at which the iteration ends.
 *
 * Returns the number m of poses found. The first m rows of `e` and `p` are the poses found.
 */
__attribute__((visibility("default"))) int rods_newton(const double *a, const double *b,
                                                       const double *lengths, int count, double *e,
                                                       double *p, double closes)
{
    int found = 0;
    for (int start = 0; start < count; start++) {
        double *own_e = e + 4 * start, *own_p = p + 3 * start;
        double A[RODS][RODS + 1];
        double left = linear_system(a, b, lengths, own_e, own_p, A);
        for (int step = 0; left >= closes && step < MAX_STEPS; step++) {
            solve(A);
            move(A, own_e, own_p);
            left = linear_system(a, b, lengths, own_e, own_p, A);
        }
        if (!(left < closes))
            continue;
        for (int k = 0; k < 4; k++)
            e[4 * found + k] = own_e[k];
        for (int k = 0; k < 3; k++)
            p[3 * found + k] = own_p[k];
        found++;
    }
    return found;
}
