/* Equations for the joints before the legs of a platform and on the platform, with up to two
 * unknown angles. This file is part of chasles and is the same for every robot. */
#ifndef CHASLES_CARRIED_ELIMINATION_H
#define CHASLES_CARRIED_ELIMINATION_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_carried_platform.h"

/* Maximum numbers of serial joints (before the legs and on the platform together), of unknown
 * joints and of solutions. */
#define CHASLES_ARM_JOINTS 6
#define CHASLES_ARM_UNKNOWN 3
#define CHASLES_ARM_SOLUTIONS 48
/* Maximum number of Newton steps. */
#define CHASLES_ARM_STEPS 40

typedef struct {
    void (*legs)(const double *T, const double *v, double *q, double *residual, double *margin);
    void (*fk)(const double *q, double *T);
    int slots, coordinates;
    int joints, before;  /* number of all joints; number of joints before the legs */
    int unknown, slides; /* number of unknowns; number of prismatic unknowns, which come first */
    int dixon;           /* whether Dixon's resultant gives the last unknown joint value */
    int solutions;       /* maximum number of solutions */
    int places[CHASLES_ARM_JOINTS]; /* for each joint transform in `maps`, the index of its joint */
    int ranks[CHASLES_ARM_JOINTS];  /* for each transform in `maps`: k if its joint is unknown k, or
                                       -1 - k if its joint has the fixed value k */
    int kinds[CHASLES_ARM_JOINTS];  /* for each transform in `maps`: 1 if its joint is prismatic,
                                       otherwise 0 */
    double size;                    /* length of the mechanism (meter) */
    double maps[CHASLES_ARM_JOINTS][3][16];
    double planes[3][4]; /* planes in which the legs keep the ball joints, in the frame of the legs:
                            unit normal and negative offset (meter) */
    double points[3][4]; /* positions of the ball joints in the platform frame (meter) */
} chasles_carried_arm_arm;

/* The equations for a tool pose, divided by the size of the mechanism. Each equation is linear in
 * (1, cos, sin) of each unknown angle, and in (1, x, 0) of each unknown displacement x. */
typedef struct {
    const chasles_carried_arm_arm *arm;
    double at[3][3][3][3];
} chasles_arm_equations;

typedef struct {
    double x[CHASLES_ARM_UNKNOWN], margin, order;
} chasles_arm_solution;

typedef struct {
    int count;
    chasles_arm_solution solution[CHASLES_ARM_SOLUTIONS];
} chasles_arm_solutions;

/* Up to three equations in an inner and an outer angle. Each equation is linear in (1, cos, sin) of
 * each of the two angles. */
typedef struct {
    int count;
    double at[3][3][3];
} chasles_arm_pair;

/* Writes (1, cos x, sin x) for a revolute joint or (1, x, 0) for a prismatic joint to `u`. Writes
 * the derivative of `u` with respect to x to `rate`. */
static void chasles_arm_basis(double x, int is_slide, double *u, double *rate)
{
    u[0] = 1.0;
    u[1] = is_slide ? x : cos(x);
    u[2] = is_slide ? 0.0 : sin(x);
    rate[0] = 0.0;
    rate[1] = is_slide ? 1.0 : -u[2];
    rate[2] = is_slide ? 0.0 : u[1];
}

/* Multiplies the row vectors `rows` by the inverse pose matrix of one joint. For an unknown joint,
 * each row becomes three rows: the coefficients of 1, of the cosine and of the sine. Returns the
 * new number of rows. */
static int chasles_arm_mapped(const chasles_carried_arm_arm *arm, int map, const double *given,
                              int count, double (*rows)[4])
{
    double next[27][4], u[3] = {1.0, 0.0, 0.0}, rate[3];
    const int rank = arm->ranks[map], parts = rank >= 0 ? 3 : 1;
    if (rank < 0)
        chasles_arm_basis(given[-1 - rank], arm->kinds[map], u, rate);
    for (int k = 0; k < count; k++) {
        for (int part = 0; part < 3; part++) {
            const double *A = arm->maps[map][part], weight = rank < 0 ? u[part] : 1.0;
            double *to = next[parts * k + (rank < 0 ? 0 : part)];
            for (int j = 0; j < 4; j++) {
                const double product = rows[k][0] * A[j] + rows[k][1] * A[4 + j] +
                                       rows[k][2] * A[8 + j] + rows[k][3] * A[12 + j];
                to[j] = (rank < 0 && part ? to[j] : 0.0) + weight * product;
            }
        }
    }
    memcpy(rows, next, (size_t)(parts * count) * sizeof *rows);
    return parts * count;
}

/* Writes the equations for the tool pose T. Returns 0 if T is not finite. */
static int chasles_arm_setup(const chasles_carried_arm_arm *arm, const double *T,
                             const double *given, chasles_arm_equations *equations)
{
    double most = 0.0;
    memset(equations, 0, sizeof *equations);
    equations->arm = arm;
    for (int i = 0; i < 3; i++) {
        double rows[27][4];
        int count = 1;
        memcpy(rows[0], arm->planes[i], sizeof rows[0]);
        for (int map = 0; map <= arm->joints; map++) {
            if (map == arm->before) {
                for (int k = 0; k < count; k++) {
                    double own[4];
                    for (int j = 0; j < 4; j++)
                        own[j] = rows[k][0] * T[j] + rows[k][1] * T[4 + j] + rows[k][2] * T[8 + j] +
                                 (j == 3 ? rows[k][3] : 0.0);
                    memcpy(rows[k], own, sizeof own);
                }
            }
            if (map < arm->joints)
                count = chasles_arm_mapped(arm, map, given, count, rows);
        }
        for (int k = 0; k < count; k++) {
            int part[CHASLES_ARM_UNKNOWN] = {0}, digits = k;
            for (int map = arm->joints - 1; map >= 0; map--) {
                if (arm->ranks[map] >= 0) {
                    part[arm->ranks[map]] = digits % 3;
                    digits /= 3;
                }
            }
            const double value =
                (chasles_carried_dot(rows[k], arm->points[i]) + rows[k][3]) / arm->size;
            equations->at[i][part[0]][part[1]][part[2]] = value;
            most += fabs(value);
        }
    }
    return most <= DBL_MAX;
}

/* Writes the errors of the equations at the joint values x to `errors`, and the derivatives of
 * these errors to `slopes`. Returns the largest absolute error. */
static double chasles_arm_error(const chasles_arm_equations *equations, const double *x,
                                double *errors, double (*slopes)[CHASLES_ARM_UNKNOWN])
{
    double u[3][3], rate[3][3], most = 0.0;
    for (int k = 0; k < 3; k++)
        chasles_arm_basis(x[k], k < equations->arm->slides, u[k], rate[k]);
    for (int i = 0; i < 3; i++) {
        errors[i] = slopes[i][0] = slopes[i][1] = slopes[i][2] = 0.0;
        for (int a = 0; a < 3; a++) {
            for (int b = 0; b < 3; b++) {
                const double *row = equations->at[i][a][b];
                const double value = chasles_carried_dot(row, u[2]);
                errors[i] += value * u[0][a] * u[1][b];
                slopes[i][0] += value * rate[0][a] * u[1][b];
                slopes[i][1] += value * u[0][a] * rate[1][b];
                slopes[i][2] += chasles_carried_dot(row, rate[2]) * u[0][a] * u[1][b];
            }
        }
        const double size = fabs(errors[i]);
        most = !(size <= DBL_MAX) ? HUGE_VAL : size > most ? size : most;
    }
    return most;
}

/* Writes the Newton step, or the Gauss-Newton step if there are fewer unknowns than equations.
 * Returns |det A| divided by the product of the row norms of the step matrix A, as a measure of the
 * distance from a singularity. */
static double chasles_arm_step(int unknown, const double *errors,
                               const double (*slopes)[CHASLES_ARM_UNKNOWN], double *step)
{
    double A[3][4], sizes = 1.0, determinant = 1.0;
    for (int i = 0; i < unknown; i++) {
        A[i][unknown] = unknown == 3 ? -errors[i] : 0.0;
        for (int j = 0; j < unknown; j++) {
            A[i][j] = unknown == 3 ? slopes[i][j] : 0.0;
            for (int k = 0; k < 3 && unknown < 3; k++)
                A[i][j] += slopes[k][i] * slopes[k][j];
        }
        for (int k = 0; k < 3 && unknown < 3; k++)
            A[i][unknown] -= slopes[k][i] * errors[k];
        double square = 0.0;
        for (int j = 0; j < unknown; j++)
            square += A[i][j] * A[i][j];
        sizes *= sqrt(square);
    }
    for (int j = 0; j < unknown; j++) {
        int pivot = j;
        for (int i = j + 1; i < unknown; i++)
            pivot = fabs(A[i][j]) > fabs(A[pivot][j]) ? i : pivot;
        for (int k = j; k <= unknown; k++) {
            const double value = A[j][k];
            A[j][k] = A[pivot][k];
            A[pivot][k] = value;
        }
        determinant *= A[j][j];
        for (int i = j + 1; i < unknown; i++) {
            const double factor = A[i][j] / A[j][j];
            for (int k = j; k <= unknown; k++)
                A[i][k] -= factor * A[j][k];
        }
    }
    for (int i = unknown - 1; i >= 0; i--) {
        step[i] = A[i][unknown];
        for (int k = i + 1; k < unknown; k++)
            step[i] -= A[i][k] * step[k];
        step[i] /= A[i][i];
    }
    return sizes > 0.0 ? fabs(determinant) / sizes : 0.0;
}

/* Refines a solution by Newton's iteration. Returns 0 if the iteration does not converge. */
static int chasles_arm_polished(const chasles_arm_equations *equations,
                                chasles_arm_solution *solution)
{
    const chasles_carried_arm_arm *arm = equations->arm;
    const double closed = arm->unknown == 3 ? CHASLES_ARM_CLOSED : CHASLES_ARM_NEAR;
    double errors[3], slopes[3][CHASLES_ARM_UNKNOWN], step[CHASLES_ARM_UNKNOWN];
    double error = chasles_arm_error(equations, solution->x, errors, slopes);
    for (int count = 0;; count++) {
        solution->margin = chasles_arm_step(arm->unknown, errors,
                                            (const double(*)[CHASLES_ARM_UNKNOWN])slopes, step);
        if (count == CHASLES_ARM_STEPS || error <= CHASLES_ARM_POLISHED)
            break;
        double next[CHASLES_ARM_UNKNOWN] = {0.0}, next_errors[3], largest = 0.0;
        double next_slopes[3][CHASLES_ARM_UNKNOWN];
        for (int k = 0; k < arm->unknown; k++) {
            const double unit = k < arm->slides ? arm->size : 1.0;
            const double size = fabs(step[k]) / unit;
            largest = !(size <= DBL_MAX) ? HUGE_VAL : size > largest ? size : largest;
        }
        if (!(largest <= DBL_MAX))
            break;
        const double part = largest > CHASLES_ARM_STEP ? CHASLES_ARM_STEP / largest : 1.0;
        for (int k = 0; k < arm->unknown; k++)
            next[k] = solution->x[k] + part * step[k];
        const double then = chasles_arm_error(equations, next, next_errors, next_slopes);
        if (!(then < error) && error <= closed)
            break;
        error = then;
        memcpy(solution->x, next, sizeof next);
        memcpy(errors, next_errors, sizeof errors);
        memcpy(slopes, next_slopes, sizeof slopes);
    }
    return error <= closed;
}

/* Refines a solution and, if the solution is new, inserts it into the list of solutions. The
 * solutions are sorted by the sum of the cosines of the unknown angles, largest sum first. */
static void chasles_arm_add(const chasles_arm_equations *equations, const double *x,
                            chasles_arm_solutions *found)
{
    const chasles_carried_arm_arm *arm = equations->arm;
    chasles_arm_solution own = {{0.0}, 0.0, 0.0};
    memcpy(own.x, x, sizeof own.x);
    if (found->count == arm->solutions || !chasles_arm_polished(equations, &own))
        return;
    for (int k = 0; k < arm->unknown; k++) {
        const int is_slide = k < arm->slides;
        own.x[k] = is_slide ? own.x[k] : chasles_circle_wrapped(own.x[k]);
        own.order += is_slide ? 0.0 : cos(own.x[k]);
    }
    int at = found->count;
    for (int i = 0; i < found->count; i++) {
        const chasles_arm_solution *other = &found->solution[i];
        double apart = 0.0;
        for (int k = 0; k < arm->unknown; k++) {
            const double change = own.x[k] - other->x[k];
            const double size =
                k < arm->slides ? change / arm->size : chasles_circle_wrapped(change);
            apart = fmax(apart, fabs(size));
        }
        if (apart < CHASLES_ARM_SAME)
            return;
        at = i < at && own.order > other->order ? i : at;
    }
    memmove(found->solution + at + 1, found->solution + at,
            (size_t)(found->count - at) * sizeof own);
    found->solution[at] = own;
    found->count++;
}

/* Writes up to three approximate solutions of equations that are linear in the cosine and sine of
 * an angle. These angles are the least-squares solution and the two solutions of the equation with
 * the largest coefficients. Returns the number of angles. */
static int chasles_arm_angles(int count, const double (*rows)[3], double *angles)
{
    double A = 0.0, B = 0.0, C = 0.0, D = 0.0, E = 0.0;
    int largest = 0;
    for (int i = 0; i < count; i++) {
        A += rows[i][1] * rows[i][1];
        B += rows[i][1] * rows[i][2];
        C += rows[i][2] * rows[i][2];
        D -= rows[i][1] * rows[i][0];
        E -= rows[i][2] * rows[i][0];
        if (hypot(rows[i][1], rows[i][2]) > hypot(rows[largest][1], rows[largest][2]))
            largest = i;
    }
    const double *row = rows[largest], size = hypot(row[1], row[2]);
    if (!(size > CHASLES_ARM_VANISHED)) {
        angles[0] = 0.0;
        return 1;
    }
    const double middle = atan2(row[2], row[1]);
    const double aside = acos(fmax(-1.0, fmin(1.0, -row[0] / size)));
    angles[0] = middle + aside;
    angles[1] = middle - aside;
    angles[2] = atan2(A * E - B * D, C * D - B * E);
    return 3;
}

/* Substitutes a value of the outer angle, and writes the coefficients of the resulting equations in
 * the inner unknown. Returns the determinant of three equations, or the resultant of two equations.
 * The returned value is zero if the equations have a common solution. */
static double chasles_arm_condition(const chasles_arm_pair *pair, double c, double s,
                                    double (*rows)[3])
{
    double D[3];
    for (int i = 0; i < pair->count; i++)
        for (int a = 0; a < 3; a++)
            rows[i][a] = pair->at[i][a][0] + c * pair->at[i][a][1] + s * pair->at[i][a][2];
    chasles_carried_cross(rows[0], rows[1], D);
    return pair->count == 3 ? chasles_carried_dot(D, rows[2])
                            : D[1] * D[1] + D[2] * D[2] - D[0] * D[0];
}

/* Divides each equation by its largest coefficient. */
static void chasles_arm_scaled(chasles_arm_pair *pair)
{
    for (int i = 0; i < pair->count; i++) {
        double *values = pair->at[i][0], most = DBL_MIN;
        for (int k = 0; k < 9; k++)
            most = fmax(most, fabs(values[k]));
        for (int k = 0; k < 9; k++)
            values[k] /= most;
    }
}

/* Writes each value of the outer angle for which the equations have a common solution. Returns 0 if
 * the equations have a common solution for every value of the outer angle. */
static int chasles_arm_outer(const chasles_arm_pair *pair, chasles_circle_roots *roots)
{
    const double *cosine = chasles_circle_cosine, *sine = chasles_circle_cosine + 72;
    chasles_circle_series series;
    double rows[3][3], values[CHASLES_CARRIED_SAMPLES];
    for (int j = 0; j < CHASLES_CARRIED_SAMPLES; j++) {
        const int at = CHASLES_CARRIED_EVERY * j;
        values[j] = chasles_arm_condition(pair, cosine[at], sine[at], rows);
    }
    chasles_carried_series(values, &series);
    roots->count = 0;
    if (!(series.most > CHASLES_ARM_VANISHED))
        return 0;
    chasles_circle_real(0, 0, &series, roots);
    return 1;
}

/* Solves the linear equations for the prismatic unknowns, and adds the complete solution to the
 * solutions found so far. */
static void chasles_arm_finish(const chasles_arm_equations *equations, double *x,
                               chasles_arm_solutions *found)
{
    const int slides = equations->arm->slides;
    double errors[3], slopes[3][CHASLES_ARM_UNKNOWN], step[CHASLES_ARM_UNKNOWN];
    memset(x, 0, (size_t)slides * sizeof *x);
    double error = chasles_arm_error(equations, x, errors, slopes);
    if (slides > 0 && chasles_arm_step(slides, errors, (const double(*)[CHASLES_ARM_UNKNOWN])slopes,
                                       step) > 0.0) {
        memcpy(x, step, (size_t)slides * sizeof *x);
        error = chasles_arm_error(equations, x, errors, slopes);
    }
    if (error <= CHASLES_ARM_TRIED)
        chasles_arm_add(equations, x, found);
}

/* Solves for an angle and for the preceding unknown. The argument `inner` is the index of the
 * preceding unknown, which is an angle or a displacement. */
static void chasles_arm_pairs(const chasles_arm_equations *equations, chasles_arm_pair *pair,
                              int inner, double *x, chasles_arm_solutions *found)
{
    const int slides = equations->arm->slides;
    chasles_circle_roots roots;
    if (slides == 1 && inner == 0) {
        /* At a solution, the constant column and the displacement column of the equations are
         * parallel, so a matrix of these two columns and any third column has determinant 0. */
        const double third[3] = {0.5773, -0.2113, 0.7887};
        for (int i = 0; i < 3; i++)
            pair->at[i][2][0] = third[i];
    }
    chasles_arm_scaled(pair);
    if (!chasles_arm_outer(pair, &roots)) {
        /* If the determinant is zero for every outer angle, either two of the three equations
         * determine both angles, or every outer angle is a solution. */
        chasles_arm_pair two = *pair;
        two.count = 2;
        for (int k = 0; inner >= slides && pair->count == 3 && k < 3; k++) {
            memcpy(two.at[0], pair->at[k], sizeof two.at[0]);
            memcpy(two.at[1], pair->at[(k + 1) % 3], sizeof two.at[1]);
            chasles_arm_pairs(equations, &two, inner, x, found);
        }
        chasles_circle_add(&roots, 0.0, 0.0);
    }
    for (int k = 0; k < roots.count; k++) {
        for (int side = roots.imaginary[k] > 0.0 ? -1 : 0; side <= (roots.imaginary[k] > 0.0);
             side++) {
            double rows[3][3], angles[3];
            x[inner + 1] = roots.angle[k] + side * roots.imaginary[k];
            if (inner < slides) {
                chasles_arm_finish(equations, x, found);
                continue;
            }
            chasles_arm_condition(pair, cos(x[inner + 1]), sin(x[inner + 1]), rows);
            const int count = chasles_arm_angles(pair->count, (const double(*)[3])rows, angles);
            for (int i = 0; i < count; i++) {
                x[inner] = angles[i];
                chasles_arm_finish(equations, x, found);
            }
        }
    }
}

/* Eliminates the displacement of the prismatic joint. In the equations, the coefficients of this
 * displacement are constant. Writes the remaining two equations to `pair`. */
static void chasles_arm_without_slide(const chasles_arm_equations *equations,
                                      chasles_arm_pair *pair)
{
    int largest = 0, count = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(equations->at[i][1][0][0]) > fabs(equations->at[largest][1][0][0]))
            largest = i;
    const double whole = equations->at[largest][1][0][0];
    for (int i = 0; i < 3; i++) {
        if (i == largest)
            continue;
        const double own = equations->at[i][1][0][0];
        for (int b = 0; b < 3; b++)
            for (int c = 0; c < 3; c++)
                pair->at[count][b][c] =
                    equations->at[i][0][b][c] * whole - equations->at[largest][0][b][c] * own;
        count++;
    }
    pair->count = count;
}

/* Substitutes a value of the third unknown joint, and writes the resulting equations in the first
 * two unknown joints. */
static void chasles_arm_at(const chasles_arm_equations *equations, double angle,
                           chasles_arm_pair *pair)
{
    double u[3], rate[3];
    chasles_arm_basis(angle, 0, u, rate);
    pair->count = 3;
    for (int i = 0; i < 3; i++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                pair->at[i][a][b] = chasles_carried_dot(equations->at[i][a][b], u);
}

/* Copies the coefficients of three equations, each linear in two displacements and in (1, cos, sin)
 * of an angle, to `pair`. */
static void chasles_arm_columns(const chasles_arm_equations *equations, chasles_arm_pair *pair)
{
    pair->count = 3;
    for (int i = 0; i < 3; i++) {
        memcpy(pair->at[i][0], equations->at[i][0][0], sizeof pair->at[i][0]);
        memcpy(pair->at[i][1], equations->at[i][1][0], sizeof pair->at[i][1]);
        memcpy(pair->at[i][2], equations->at[i][0][1], sizeof pair->at[i][2]);
    }
}

#endif
