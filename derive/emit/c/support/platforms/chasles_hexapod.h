/* Finds every assembly mode of a platform on six rods. This file is part of chasles and is the same
 * for every robot.
 *
 * Path tracking starts from a platform with other rods (the start rods). All complex poses of this
 * platform are known. Path tracking follows the complex poses while the rods change from the start
 * rods to the current rods. The real poses for the current rods are the assembly modes. If the rods
 * end in three double joints, the zeros of a polynomial give the assembly modes. For platforms with
 * three double joints, path tracking runs only if the polynomial leaves the number of assembly
 * modes uncertain. */
#ifndef CHASLES_HEXAPOD_H
#define CHASLES_HEXAPOD_H

#include <float.h>

#include "chasles_double_joints.h"
#include "chasles_hexapod_paths.h"
#include "chasles_solve_six.h"

/* Maximum number of Newton steps for the rod lengths, which is large because each step only halves
 * the error at a double solution. */
#define CHASLES_MODE_STEPS 40

typedef struct {
    /* Computes the rod ends on the actuated side and the rod lengths from the actuator coordinates.
     */
    void (*rods)(const double *q, double *a, double *l);
    double size;      /* size of the platform (meter) */
    double origin[3]; /* centers of the rod ends a (`origin`) and b (`middle`), relative to the
                         platform size */
    double middle[3];
    int axis[3];    /* axes of the three rotation angles in theta, in order */
    int moves;      /* whether the actuators move the rod ends */
    int paths;      /* number of complex poses, which is also the number of solution slots */
    int joined;     /* which side has joints shared by two rods (0 none, 1 platform, 2 base) */
    int pairs[6];   /* indices of the rods, ordered in pairs of two rods that share a joint */
    double b[6][3]; /* rod ends on the platform, relative to the platform size */
    chasles_hexapod_number a[6][3], c[6];
    chasles_hexapod_number starts[CHASLES_MAX_PATHS][CHASLES_SOMA];
} chasles_hexapod_platform;

/* Rod ends on the actuated side and rod lengths at given actuator coordinates, relative to the
 * platform size. */
typedef struct {
    double a[6][3], l[6];
} chasles_hexapod_rods;

/* A real pose, given by a unit quaternion and the position. */
typedef struct {
    double e[4], p[3], margin;
} chasles_hexapod_mode;

static void chasles_hexapod_product(const double *x, const double *y, double *xy)
{
    xy[0] = x[0] * y[0] - x[1] * y[1] - x[2] * y[2] - x[3] * y[3];
    xy[1] = x[0] * y[1] + x[1] * y[0] + x[2] * y[3] - x[3] * y[2];
    xy[2] = x[0] * y[2] - x[1] * y[3] + x[2] * y[0] + x[3] * y[1];
    xy[3] = x[0] * y[3] + x[1] * y[2] - x[2] * y[1] + x[3] * y[0];
}

static void chasles_hexapod_rotation(const double *e, double (*R)[3])
{
    const double w = e[0], x = e[1], y = e[2], z = e[3];
    R[0][0] = w * w + x * x - y * y - z * z, R[0][1] = 2.0 * (x * y - w * z);
    R[1][1] = w * w - x * x + y * y - z * z, R[1][0] = 2.0 * (x * y + w * z);
    R[2][2] = w * w - x * x - y * y + z * z, R[0][2] = 2.0 * (x * z + w * y);
    R[2][0] = 2.0 * (x * z - w * y), R[1][2] = 2.0 * (y * z - w * x),
    R[2][1] = 2.0 * (y * z + w * x);
}

/* Computes 1 - |<x, y>|^2 for complex unit vectors x and y without cancellation. If `conjugate` is
 * set, the complex conjugate of y replaces y. */
static double chasles_hexapod_apart(const chasles_hexapod_number *x,
                                    const chasles_hexapod_number *y, int conjugate)
{
    double re = 0.0, im = 0.0, sum = 0.0;
    const double sign = conjugate ? -1.0 : 1.0;
    for (int k = 0; k < CHASLES_SOMA; k++) {
        re += x[k].re * y[k].re + sign * x[k].im * y[k].im;
        im += x[k].im * y[k].re - sign * x[k].re * y[k].im;
    }
    for (int k = 0; k < CHASLES_SOMA; k++) {
        const double r = x[k].re - (re * y[k].re - im * sign * y[k].im);
        const double i = x[k].im - (re * sign * y[k].im + im * y[k].re);
        sum += r * r + i * i;
    }
    return sum;
}

/* Returns |e.e| for the Euler parameters e of a pose, which is 0 for a pose at infinity. */
static double chasles_hexapod_finite(const chasles_hexapod_number *x)
{
    double re = 0.0, im = 0.0;
    for (int k = 0; k < 4; k++) {
        re += x[k].re * x[k].re - x[k].im * x[k].im;
        im += 2.0 * x[k].re * x[k].im;
    }
    return sqrt(re * re + im * im);
}

/* Returns whether a path reached its end, which is a pose or a point at infinity. */
static int chasles_hexapod_ended(const chasles_hexapod_end *end)
{
    return end->t > 1.0 - CHASLES_PATH_ALMOST;
}

/* Selects the paths that must be tracked again with smaller Newton corrections. A path is repeated
 * if it did not reach its end, or if its end coincides with the end of another path. */
static int chasles_hexapod_again(const chasles_hexapod_end *ends, int count, int *which)
{
    int again = 0;
    for (int i = 0; i < count; i++) {
        int doubtful = !chasles_hexapod_ended(ends + i);
        for (int k = 0; k < count && !doubtful; k++)
            doubtful = k != i && ends[i].t == 1.0 && ends[k].t == 1.0 &&
                       chasles_hexapod_apart(ends[i].x, ends[k].x, 0) < CHASLES_ENDS_ARE_ONE;
        if (doubtful)
            which[again++] = i;
    }
    return again;
}

/* Computes the real-valued pose at the end of a path. Returns 0 if the pose at the path end is not
 * nearly real, or is at infinity. */
static int chasles_hexapod_real(const chasles_hexapod_end *end, chasles_hexapod_mode *mode)
{
    const chasles_hexapod_number *x = end->x;
    double most = 0.0, real[8], size = 0.0, imaginary = 0.0, back[4], p[4];
    int at = 0;
    for (int k = 0; k < 4; k++) {
        const double square = x[k].re * x[k].re + x[k].im * x[k].im;
        size += square;
        if (square > most)
            most = square, at = k;
    }
    if (!(chasles_hexapod_finite(x) > CHASLES_AT_INFINITY))
        return 0;
    const double c = x[at].re / sqrt(most * size), s = x[at].im / sqrt(most * size);
    for (int k = 0; k < CHASLES_SOMA; k++) {
        real[k] = c * x[k].re + s * x[k].im;
        const double im = c * x[k].im - s * x[k].re;
        imaginary += im * im;
    }
    /* The tolerance for the imaginary part of a pose grows with the distance of the platform from
     * the base. */
    double far = 1.0;
    for (int k = 4; k < CHASLES_SOMA; k++)
        far += real[k] * real[k];
    if (!(imaginary < CHASLES_NEARLY_REAL_POSE * CHASLES_NEARLY_REAL_POSE * far))
        return 0;
    for (int k = 0; k < 4; k++)
        mode->e[k] = real[k], back[k] = k > 0 ? -real[k] : real[k];
    chasles_hexapod_product(real + 4, back, p);
    memcpy(mode->p, p + 1, sizeof mode->p);
    return 1;
}

/* Computes the errors of the rod lengths and their Jacobian. The row of each rod is (n, r x n),
 * with the rod direction n and the lever arm r of the rod's platform end. Returns the largest
 * absolute error of the rod lengths. */
static double chasles_hexapod_excess(const chasles_hexapod_platform *platform,
                                     const chasles_hexapod_rods *rods,
                                     const chasles_hexapod_mode *mode, double (*J)[7])
{
    double R[3][3], most = 0.0;
    chasles_hexapod_rotation(mode->e, R);
    for (int i = 0; i < CHASLES_RODS; i++) {
        double r[3], d[3], sum = 0.0;
        for (int k = 0; k < 3; k++) {
            const double *b = platform->b[i];
            r[k] = R[k][0] * b[0] + R[k][1] * b[1] + R[k][2] * b[2];
            d[k] = mode->p[k] + r[k] - rods->a[i][k];
            sum += d[k] * d[k];
        }
        const double length = sqrt(sum), inverse = length > 0.0 ? 1.0 / length : 0.0;
        for (int k = 0; k < 3; k++) {
            const int m = (k + 1) % 3, n = (k + 2) % 3;
            J[i][k] = d[k] * inverse;
            J[i][3 + k] = (r[m] * d[n] - r[n] * d[m]) * inverse;
        }
        J[i][6] = rods->l[i] - length;
        const double error = fabs(J[i][6]);
        most = error > most || error != error ? error : most;
    }
    return most;
}

/* Returns the ratio of |det J| to the product of the row norms of J. */
static double chasles_hexapod_margin(double (*J)[7])
{
    double x[6], lengths = 1.0;
    for (int i = 0; i < 6; i++) {
        double sum = 0.0;
        for (int k = 0; k < 6; k++)
            sum += J[i][k] * J[i][k];
        lengths *= sqrt(sum);
    }
    return fabs(chasles_solve_six(J, x)) / lengths;
}

/* Solves the rod length equations by Newton's iteration. Returns 0 if the iteration does not
 * converge or leads to another pose. */
static int chasles_hexapod_polished(const chasles_hexapod_platform *platform,
                                    const chasles_hexapod_rods *rods, chasles_hexapod_mode *mode)
{
    double J[6][7], step[6], moved = 0.0;
    double error = chasles_hexapod_excess(platform, rods, mode, J);
    for (int k = 0; k < CHASLES_MODE_STEPS && error > CHASLES_RODS_POLISHED; k++) {
        chasles_hexapod_mode next = *mode;
        double half[4] = {0.0}, turned[4], size = 0.0;
        double kept[6][7];
        if (chasles_solve_six(J, step) == 0.0)
            break;
        for (int i = 0; i < 3; i++)
            next.p[i] += step[i], half[1 + i] = 0.5 * step[3 + i];
        chasles_hexapod_product(half, mode->e, turned);
        for (int i = 0; i < 4; i++)
            next.e[i] += turned[i], size += next.e[i] * next.e[i];
        for (int i = 0; i < 4; i++)
            next.e[i] /= sqrt(size);
        const double then = chasles_hexapod_excess(platform, rods, &next, kept);
        if (!(then < error))
            break;
        for (int i = 0; i < 6; i++)
            moved += fabs(step[i]);
        if (!(moved < CHASLES_SAME_END))
            return 0;
        error = then;
        *mode = next;
        memcpy(J, kept, sizeof J);
    }
    if (!(error <= CHASLES_RODS_CLOSED))
        return 0;
    chasles_hexapod_excess(platform, rods, mode, J);
    mode->margin = chasles_hexapod_margin(J);
    return 1;
}

static int chasles_hexapod_same(const chasles_hexapod_mode *one, const chasles_hexapod_mode *other)
{
    double along = 0.0, turned = 0.0, most = 0.0;
    for (int k = 0; k < 4; k++)
        along += one->e[k] * other->e[k];
    for (int k = 0; k < 4; k++) {
        const double difference = one->e[k] - copysign(1.0, along) * other->e[k];
        turned += difference * difference;
    }
    for (int k = 0; k < 3; k++) {
        const double difference = fabs(one->p[k] - other->p[k]);
        most = difference > most ? difference : most;
    }
    return most < CHASLES_ONE_MODE && 4.0 * turned < CHASLES_ONE_MODE * CHASLES_ONE_MODE;
}

/* Computes the position (meter) and the rotation angles of an assembly mode. */
static void chasles_hexapod_theta(const chasles_hexapod_platform *platform,
                                  const chasles_hexapod_mode *mode, double *theta)
{
    double R[3][3];
    const int i = platform->axis[0], j = platform->axis[1], k = platform->axis[2];
    const double s = (j - i + 3) % 3 == 1 ? 1.0 : -1.0;
    chasles_hexapod_rotation(mode->e, R);
    for (int n = 0; n < 3; n++) {
        const double *m = platform->middle;
        const double turned = R[n][0] * m[0] + R[n][1] * m[1] + R[n][2] * m[2];
        theta[n] = platform->size * (mode->p[n] + platform->origin[n] - turned);
    }
    const double cosine = sqrt(R[i][i] * R[i][i] + R[i][j] * R[i][j]);
    theta[4] = atan2(s * R[i][k], cosine);
    if (cosine > CHASLES_GIMBAL) {
        theta[3] = atan2(-s * R[j][k], R[k][k]);
        theta[5] = atan2(-s * R[i][j], R[i][i]);
    } else {
        theta[3] = atan2(s * R[k][j], R[j][j]);
        theta[5] = 0.0;
    }
}

/* Counts the path ends whose complex conjugate is not a path end. The equations of the current rods
 * are real, so path ends should occur in complex conjugate pairs. */
static int chasles_hexapod_unpaired(const chasles_hexapod_end *ends, int count)
{
    int unpaired = 0;
    for (int i = 0; i < count; i++) {
        int found = ends[i].t < 1.0 || !(chasles_hexapod_finite(ends[i].x) > CHASLES_AT_INFINITY);
        for (int k = 0; k < count && !found; k++)
            found = chasles_hexapod_apart(ends[i].x, ends[k].x, 1) < CHASLES_ENDS_ARE_PAIRED;
        unpaired += !found;
    }
    return unpaired;
}

/* Computes the rod lengths and the rod ends on the base, relative to the platform size. Returns 0
 * if a rod length or a rod end is not finite. */
static int chasles_hexapod_given(const chasles_hexapod_platform *platform, const double *q,
                                 chasles_hexapod_rods *rods)
{
    double sum = 0.0;
    platform->rods(q, rods->a[0], rods->l);
    for (int i = 0; i < CHASLES_RODS; i++) {
        rods->l[i] /= platform->size;
        sum += fabs(rods->l[i]);
        for (int k = 0; k < 3; k++) {
            rods->a[i][k] = rods->a[i][k] / platform->size - platform->origin[k];
            sum += fabs(rods->a[i][k]);
        }
    }
    return sum < DBL_MAX;
}

/* Creates the homotopy that leads from the start rods to the current rods. */
static void chasles_hexapod_path_to(const chasles_hexapod_platform *platform,
                                    const chasles_hexapod_rods *rods, chasles_hexapod_path *path)
{
    chasles_hexapod_number a[6][3] = {{{0.0, 0.0}}}, c[6] = {{0.0, 0.0}};
    for (int i = 0; i < CHASLES_RODS; i++) {
        c[i].re = -rods->l[i] * rods->l[i];
        for (int k = 0; k < 3; k++) {
            a[i][k].re = rods->a[i][k];
            c[i].re += rods->a[i][k] * rods->a[i][k] + platform->b[i][k] * platform->b[i][k];
        }
    }
    chasles_hexapod_forms_of(platform->a, platform->b, platform->c, &path->at);
    chasles_hexapod_forms_of((const chasles_hexapod_number(*)[3])a, platform->b, c, &path->change);
    for (int i = 0; i < CHASLES_RODS; i++) {
        for (int k = 0; k < 6; k++) {
            path->change.M[i][k].re -= path->at.M[i][k].re;
            path->change.M[i][k].im -= path->at.M[i][k].im;
        }
        for (int k = 0; k < 10; k++) {
            path->change.S[i][k].re -= path->at.S[i][k].re;
            path->change.S[i][k].im -= path->at.S[i][k].im;
        }
    }
    path->moves = platform->moves;
}

/* Follows all homotopy paths from the poses with the start rods to the poses with `rods`. Returns
 * the number of paths with an uncertain end. */
static int chasles_hexapod_ends(const chasles_hexapod_platform *platform,
                                const chasles_hexapod_rods *rods, chasles_hexapod_end *ends)
{
    const double near[3] = {CHASLES_PATH_NEAR, CHASLES_PATH_NEARER, CHASLES_PATH_NEAREST};
    const int paths = platform->paths;
    chasles_hexapod_path path;
    int which[CHASLES_MAX_PATHS], again = paths, lost = 0;
    chasles_hexapod_path_to(platform, rods, &path);
    for (int k = 0; k < paths; k++)
        which[k] = k;
    for (int pass = 0; pass < 3 && again > 0; pass++) {
        chasles_hexapod_follow(&path, platform->starts, which, again, near[pass], ends);
        again = chasles_hexapod_again(ends, paths, which);
    }
    for (int k = 0; k < paths; k++)
        lost += !chasles_hexapod_ended(ends + k);
    return lost + chasles_hexapod_unpaired(ends, paths);
}

/* Inserts a new assembly mode into the list of modes, which is sorted by the height of the
 * platform, highest first. Returns the number of assembly modes. */
static int chasles_hexapod_added(const chasles_hexapod_mode *mode, chasles_hexapod_mode *modes,
                                 int count)
{
    for (int m = 0; m < count; m++) {
        if (chasles_hexapod_same(mode, modes + m))
            return count;
    }
    int at = count;
    for (; at > 0 && modes[at - 1].p[2] < mode->p[2]; at--)
        modes[at] = modes[at - 1];
    modes[at] = *mode;
    return count + 1;
}

/* Finds the assembly modes of a platform whose rods end in double joints. Returns the number of
 * assembly modes, or -1 if the number is uncertain. */
static int chasles_hexapod_joined(const chasles_hexapod_platform *platform,
                                  const chasles_hexapod_rods *rods, chasles_hexapod_mode *modes)
{
    const int inverse = platform->joined == 2;
    const double(*ends)[3] = inverse ? platform->b : (const double(*)[3])rods->a;
    const double(*joints)[3] = inverse ? (const double(*)[3])rods->a : platform->b;
    double a[6][3], l[6], b[3][3], poses[2 * CHASLES_DEGREE][7];
    int count = 0;
    for (int i = 0; i < CHASLES_RODS; i++) {
        const int rod = platform->pairs[i];
        l[i] = rods->l[rod];
        memcpy(a[i], ends[rod], sizeof a[i]);
        memcpy(b[i / 2], joints[rod], sizeof b[0]);
    }
    const int found =
        chasles_double_joint_poses((const double(*)[3])a, l, (const double(*)[3])b, poses);
    for (int k = 0; k < found; k++) {
        chasles_hexapod_mode mode;
        memcpy(mode.e, poses[k], sizeof mode.e);
        memcpy(mode.p, poses[k] + 4, sizeof mode.p);
        if (inverse) {
            double R[3][3];
            mode.e[0] = -mode.e[0];
            chasles_hexapod_rotation(mode.e, R);
            for (int i = 0; i < 3; i++)
                mode.p[i] = -chasles_joint_dot(R[i], poses[k] + 4);
        }
        if (!chasles_hexapod_polished(platform, rods, &mode))
            return -1;
        count = chasles_hexapod_added(&mode, modes, count);
    }
    return found < 0 || count == found ? found : -1;
}

/* Finds the assembly modes among the poses at the path ends. Returns the number of assembly modes.
 */
static int chasles_hexapod_followed(const chasles_hexapod_platform *platform,
                                    const chasles_hexapod_rods *rods, chasles_hexapod_mode *modes,
                                    double *unsure)
{
    chasles_hexapod_end ends[CHASLES_MAX_PATHS];
    chasles_hexapod_mode mode;
    int count = 0;
    *unsure = chasles_hexapod_ends(platform, rods, ends);
    for (int k = 0; k < platform->paths; k++) {
        if (chasles_hexapod_ended(ends + k) && chasles_hexapod_real(ends + k, &mode) &&
            chasles_hexapod_polished(platform, rods, &mode))
            count = chasles_hexapod_added(&mode, modes, count);
    }
    return count;
}

/* Writes all assembly modes, the highest platform first, and fills the remaining slots with NaN.
 * Writes the margin of each assembly mode, and the number of complex poses that may be missing. */
static void chasles_hexapod_modes(const chasles_hexapod_platform *platform, const double *q,
                                  double *theta, double *margin, double *unsure)
{
    chasles_hexapod_rods rods;
    chasles_hexapod_mode modes[CHASLES_MAX_PATHS];
    int count = 0, possible = 1;
    const int finite = chasles_hexapod_given(platform, q, &rods);
    for (int i = 0; i < CHASLES_RODS; i++)
        possible = possible && rods.l[i] >= 0.0;
    *unsure = finite ? 0.0 : NAN;
    if (finite && possible) {
        count = platform->joined ? chasles_hexapod_joined(platform, &rods, modes) : -1;
        if (count < 0)
            count = chasles_hexapod_followed(platform, &rods, modes, unsure);
    }
    for (int k = 0; k < platform->paths; k++) {
        margin[k] = k < count ? modes[k].margin : NAN;
        for (int i = 0; i < 6; i++)
            theta[6 * k + i] = NAN;
        if (k < count)
            chasles_hexapod_theta(platform, modes + k, theta + 6 * k);
    }
}

#endif
