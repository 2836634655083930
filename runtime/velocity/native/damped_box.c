#include "velocity/native/damped_box.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "numerics/_linear_solve.h"
#include "numerics/_orthogonal.h"
#include "numerics/_tolerances.h"

#define MAX_AGE 64 /* number of decompositions after which U is reset */
#define ROUNDS 8   /* maximum number of active-set iterations per variable */

int damped_box_new(DampedBox *box, int n)
{
    size_t N = (size_t)n;
    double *block = malloc((N * (TWIST + 3 + 2 * N)) * sizeof(double) + 2 * N * sizeof(int));
    if (!block) {
        return 0;
    }
    *box = (DampedBox){.n = n, .rows = block};
    box->x = box->rows + TWIST * N;
    box->g = box->x + N;
    box->z = box->g + N;
    box->H = box->z + N;
    box->A = box->H + N * N;
    box->at = (int *)(box->A + N * N);
    box->free = box->at + N;
    return 1;
}

void damped_box_start(DampedBox *box, double border, double damping)
{
    box->moving = box->n;
    box->border = border;
    box->least_damping = box->damping = damping;
    box->age = MAX_AGE;
}

void damped_box_free(DampedBox *box)
{
    free(box->rows);
}

/* Tests whether the scalar product ab is negligible relative to max(aa, bb). */
static int is_orthogonal_enough(double aa, double bb, double ab, double unused)
{
    (void)unused;
    return !(fabs(ab) > BOX_ORTHOGONAL * fmax(aa, bb));
}

static void apply_last_rotations(DampedBox *box, const double *J)
{
    int n = box->n;
    if (box->age++ >= MAX_AGE) {
        memset(box->U, 0, sizeof box->U);
        for (int i = 0; i < TWIST; i++) {
            box->U[(TWIST + 1) * i] = 1;
        }
        box->age = 0;
    }
    for (int i = 0; i < TWIST; i++) {
        double *row = box->rows + i * n;
        memset(row, 0, n * sizeof *row);
        for (int k = 0; k < TWIST; k++) {
            double u = box->U[TWIST * i + k];
            for (int j = 0; j < n; j++) {
                row[j] += u * J[k * n + j];
            }
        }
    }
}

double damped_box_decompose(DampedBox *box, const double *J)
{
    int n = box->n;
    apply_last_rotations(box, J);
    orthogonalize_rows(box->rows, TWIST, n, box->U, TWIST, is_orthogonal_enough, 0);
    double ordered[TWIST], border = fmax(box->border, box->damping);
    for (int i = 0; i < TWIST; i++) {
        double value = sqrt(dot(box->rows + i * n, box->rows + i * n, n));
        double part = value / border;
        box->sigma[i] = value;
        box->damping_square[i] = part < 1 ? (1 - part * part) * box->damping * box->damping : 0;
        int rank = i;
        for (; rank > 0 && ordered[rank - 1] < value; rank--) {
            ordered[rank] = ordered[rank - 1];
        }
        ordered[rank] = value;
    }
    return ordered[(box->moving < TWIST ? box->moving : TWIST) - 1];
}

void damped_box_solve(DampedBox *box, const double *y)
{
    memset(box->x, 0, box->n * sizeof *box->x);
    for (int i = 0; i < TWIST; i++) {
        double square = box->sigma[i] * box->sigma[i] + box->damping_square[i];
        double along = dot(box->U + TWIST * i, y, TWIST) / square;
        for (int j = 0; j < box->n; j++) {
            box->x[j] += along * box->rows[i * box->n + j];
        }
    }
}

static void solve_free(DampedBox *box, int count)
{
    int n = box->n;
    for (int a = 0; a < count; a++) {
        int i = box->free[a];
        double right = box->g[i];
        for (int j = 0; j < n; j++) {
            right -= box->at[j] ? box->H[i * n + j] * box->x[j] : 0;
        }
        box->z[a] = right;
        for (int b = 0; b <= a; b++) {
            box->A[a * n + b] = box->H[i * n + box->free[b]];
        }
    }
    solve_symmetric(box->A, count, n, box->z);
}

/* Moves x on a straight line towards z until the first variable reaches a bound, and fixes this
 * variable at the bound. Returns 0 if x reaches z without meeting a bound. */
static int advance_to_bound(DampedBox *box, int count, const double *lower, const double *upper)
{
    double part = 1;
    int met = -1;
    for (int a = 0; a < count; a++) {
        int i = box->free[a];
        double bound = box->z[a] < lower[i] ? lower[i] : upper[i];
        double to_bound = (bound - box->x[i]) / (box->z[a] - box->x[i]);
        if ((box->z[a] < lower[i] || box->z[a] > upper[i]) && to_bound < part) {
            part = fmax(to_bound, 0);
            met = a;
        }
    }
    for (int a = 0; a < count; a++) {
        box->x[box->free[a]] += part * (box->z[a] - box->x[box->free[a]]);
    }
    if (met < 0) {
        return 0;
    }
    int i = box->free[met];
    box->at[i] = box->z[met] < lower[i] ? -1 : 1;
    box->x[i] = box->at[i] < 0 ? lower[i] : upper[i];
    return 1;
}

/* Releases the variable whose multiplier is largest. Returns 0 if no multiplier is positive. */
static int release_bound(DampedBox *box, const double *lower, const double *upper)
{
    int n = box->n, best = -1;
    double largest = 0;
    for (int i = 0; i < n; i++) {
        largest = fmax(largest, BOX_RELEASE * fabs(box->g[i]));
    }
    for (int i = 0; i < n; i++) {
        if (box->at[i] == 0 || lower[i] == upper[i]) {
            continue;
        }
        double multiplier = -box->at[i] * (box->g[i] - dot(box->H + i * n, box->x, n));
        if (multiplier > largest) {
            largest = multiplier;
            best = i;
        }
    }
    if (best < 0) {
        return 0;
    }
    box->at[best] = 0;
    return 1;
}

/* Writes the matrix H and the right-hand side g = H x of the bounded problem. */
static void bounded_problem(DampedBox *box)
{
    int n = box->n;
    memset(box->H, 0, (size_t)n * n * sizeof *box->H);
    for (int k = 0; k < TWIST; k++) {
        double square = box->sigma[k] * box->sigma[k], *row = box->rows + k * n;
        double weight = square > 0 ? 1 + box->damping_square[k] / square : 0;
        for (int i = 0; i < n; i++) {
            for (int j = 0; j < n; j++) {
                box->H[i * n + j] += weight * row[i] * row[j];
            }
        }
    }
    double added = BOX_NULL_SPACE_DAMPING * box->border;
    for (int i = 0; i < n; i++) {
        box->H[(n + 1) * i] += added * added;
    }
    for (int i = 0; i < n; i++) {
        box->g[i] = dot(box->H + i * n, box->x, n);
    }
}

void damped_box_bound(DampedBox *box, const double *lower, const double *upper)
{
    int n = box->n, outside = 0;
    for (int i = 0; i < n; i++) {
        box->at[i] = box->x[i] < lower[i] ? -1 : box->x[i] > upper[i] ? 1 : 0;
        outside |= box->at[i];
    }
    if (!outside) {
        return;
    }
    bounded_problem(box);
    for (int i = 0; i < n; i++) {
        box->x[i] = box->at[i] < 0 ? lower[i] : box->at[i] > 0 ? upper[i] : box->x[i];
    }
    /* x is within the bounds after every iteration, so x is usable without convergence. */
    for (int round = 0; round < ROUNDS * n; round++) {
        int count = 0;
        for (int i = 0; i < n; i++) {
            if (!box->at[i]) {
                box->free[count++] = i;
            }
        }
        solve_free(box, count);
        if (!advance_to_bound(box, count, lower, upper) && !release_bound(box, lower, upper)) {
            return;
        }
    }
}

double damped_box_residual(const DampedBox *box, const double *y)
{
    double sum = 0;
    for (int i = 0; i < TWIST; i++) {
        double rest =
            dot(box->U + TWIST * i, y, TWIST) - dot(box->rows + i * box->n, box->x, box->n);
        sum += rest * rest;
    }
    return sum;
}

void damped_box_adapt(DampedBox *box, double before, double expected, double after)
{
    double gained = before - after, predicted = before - expected;
    if (predicted <= TRACK_NO_DECREASE * before) {
        return;
    }
    if (gained < TRACK_POOR_STEP * predicted) {
        box->damping = fmin(TRACK_RAISE_DAMPING * box->damping, TRACK_GREATEST_DAMPING);
    } else if (gained > TRACK_GOOD_STEP * predicted) {
        box->damping = fmax(box->damping / TRACK_LOWER_DAMPING, box->least_damping);
    }
}
