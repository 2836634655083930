/* The equations of Raghavan and Roth for a six-joint arm at one pose. This file is part of chasles
 * and is the same for every robot.
 *
 * The arm and the target pose form a closed loop. The loop, numbered from any joint in either
 * direction, gives fourteen equations A y = B(s) x. The vector y contains the products of the
 * cosines and sines of two joints, which are called the pair. The vector x contains the products
 * of (1, cos, sin) of joint v and (1, cos, sin) of joint w. The angle s belongs to another joint,
 * which is called the suppressed joint. Depending on the numbering of the joints, any constant
 * transform of the loop may contain the target pose. Six linear combinations of the fourteen
 * equations do not contain y. Expressed in the half angle of joint v, the six combinations become
 * twelve equations M(s) u = 0 in twelve unknowns. The determinant det M is a trigonometric
 * polynomial of degree 8 in s. Samples of det M give its real roots (chasles_general_roots.h), and
 * each root gives the other joints (chasles_general_back.h). Newton's iteration on the target pose
 * refines the joint values (chasles_general_newton.h). An elimination order (type
 * chasles_general_order) is the order in which the joints are numbered. If one elimination order
 * fails, chasles_general.h tries other elimination orders and nearby poses. The computations use
 * SIMD vectors (chasles_vectors.h) with one sample, root or solution in each lane. The code
 * allocates nothing, has no state and depends only on libm.
 *
 * For a prismatic joint, the displacement d and its square d^2 replace the cosine and the sine. A
 * prismatic joint either belongs to the pair, or is joint v or w. If joint v is prismatic, the half
 * angle of joint w replaces the half angle of joint v. If both joints of the pair are prismatic,
 * half of the roots of det M do not belong to solutions.
 */
#ifndef CHASLES_GENERAL_EQUATIONS_H
#define CHASLES_GENERAL_EQUATIONS_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_circle_roots.h"

/* Largest residual [m, rad] of a valid solution, which has the same value in the runtime. */
#define CHASLES_SOLVED 1e-9
/* Newton's iteration ends at this residual [m, rad], which is ten times the rounding error of
 * forward kinematics. */
#define CHASLES_CLOSED 1e-14
/* If the residual [m, rad] is below this value, Newton's iteration ends at the first step without
 * improvement, because rounding errors may dominate. */
#define CHASLES_NEARLY_CLOSED 1e-12
/* Two solutions are equal if their coordinates differ by less than this value (rad, or relative to
 * the arm length). */
#define CHASLES_SAME 1e-6
/* A slow Newton iteration is stopped if its residual [m, rad] is above this value. */
#define CHASLES_NEAR 1e-4
/* This value is added to pivots that may be zero, in matrices with entries of about 1 and rounding
 * errors of about 1e-16. */
#define CHASLES_PIVOT_FLOOR 1e-30
/* Maximum error of the polynomial det M, relative to its largest coefficient. */
#define CHASLES_NOISE 1e-6
/* For some arrangements of the joint axes, det M is zero for all angles. The entries of M are of
 * order 1. If the largest coefficient of det M is below CHASLES_VANISHED, det M may be a zero
 * polynomial with rounding errors. A polynomial det M with such small coefficients is accepted if
 * its error, relative to the largest coefficient, is below CHASLES_CLEAN. */
#define CHASLES_VANISHED 1e-15
#define CHASLES_CLEAN 1e-9
/* A root of det M can belong to a solution only if the residual of the eight equations that contain
 * y is below CHASLES_SOLVES_ALL. In this residual, lengths are divided by the arm length, and
 * squared lengths by the square of the arm length. If the pair contains a prismatic joint, the
 * equations determine both joint values of the pair only if the smallest pivot of A exceeds
 * CHASLES_TELLS times the largest pivot. */
#define CHASLES_SOLVES_ALL 1e-4
#define CHASLES_TELLS 1e-9
/* If the squared rotation angle [rad^2] is below this value, an arcsine series of third order is
 * exact to rounding. */
#define CHASLES_SMALL_TURN 1e-7
/* Initial damping of Newton's steps far from a solution, relative to the squared entries of J. */
#define CHASLES_DAMPING_FAR 1e-5
/* Initial damping of Newton's steps near a solution. */
#define CHASLES_DAMPING_NEAR 1e-14
/* A damping below this value is set to zero. */
#define CHASLES_DAMPING_DROPPED 1e-13
/* Newton's iteration is abandoned if its damping exceeds this value. */
#define CHASLES_DAMPING_MAX 1e3
/* This value is added to the diagonal of J^T J before inverse iteration computes the eigenvector of
 * the smallest eigenvalue. */
#define CHASLES_SHIFT 1e-10

/* Fifteen quantities describe a line with point p and direction l: p, l, p.p, p.l, p x l, (p.p) l -
 * 2 (p.l) p, and 1. */
#define CHASLES_EQUATIONS 14
#define CHASLES_CHAIN_MAX_JOINTS 12
#define CHASLES_CHAIN_MAX_GIVEN (CHASLES_CHAIN_MAX_JOINTS - 6)
#define CHASLES_ORDERS 4
/* Maximum number of Newton steps. */
#define CHASLES_STEPS 20
/* Joint angle [rad] at which the variable of the half-angle substitution is zero. */
#define CHASLES_HALF_FROM 0.61

/* An elimination order, which is the order of the joints in the equations. */
typedef struct {
    int joint[6]; /* joint indices: first the two joints of the pair, then the suppressed joint,
                     joint v, joint w and the last joint */
    int sense;    /* 1 if the loop is numbered from base to tool, -1 if it is numbered from tool to
                     base */
    int halved;   /* the joint of the half-angle substitution: 0 for joint v, 1 for joint w */
} chasles_general_order;

/* A joint. */
#define CHASLES_SOLVED_TURN 0
#define CHASLES_GIVEN_TURN 1
#define CHASLES_GIVEN_SLIDE 2
#define CHASLES_SOLVED_SLIDE 3

/* An arm with six unknown joints, whose other joints are fixed. An arm with only five unknown
 * joints gets an added sixth joint, which rotates the tool. */
typedef struct {
    /* Function that computes the robot's forward kinematics and mixed Jacobian. */
    void (*pose_jacobian)(const double *q, double *T, double *J);
    int joints;
    int kind[CHASLES_CHAIN_MAX_JOINTS];
    double direction[CHASLES_CHAIN_MAX_JOINTS]; /* for each joint, the sign of its rotation about z
                                                   or its translation along z */
    double length; /* size of the arm (m), which converts radians to meters */
    double placed[CHASLES_CHAIN_MAX_JOINTS + 1][12]; /* constant transforms before, between and
                                                        after the joints, as 3 x 4 matrices */
    int orders;
    chasles_general_order order[CHASLES_ORDERS]; /* best first */
} chasles_general_arm;

/* An arm whose fixed joints have given values, so that six unknown joints remain. Lengths,
 * including the coordinates of unknown prismatic joints, are divided by the arm length. */
typedef struct {
    const chasles_general_arm *arm;
    double value[CHASLES_CHAIN_MAX_GIVEN]; /* values of the fixed joints (rad or m) */
    int own[6];                            /* indices of the six unknown joints */
    int slides[6];                         /* whether each of the six unknown joints is prismatic */
    int has_slides;
    int has_tool_joint; /* whether the sixth joint is an added joint that rotates the tool */
    double placed[7][12];
} chasles_general_six;

/* Coefficients of the equations of one elimination order for one target pose. */
typedef struct {
    double loop[6][12];   /* C_1 ... C_6 */
    int slides[6];        /* whether each joint of the elimination order is prismatic */
    double factor[8][8];  /* triangular factor of the matrix A */
    double head[3][8][9]; /* coefficients of B in the eight equations that determine y */
    double rest[3][6][9]; /* coefficients of 1, cos s and sin s in the six equations from which y is
                             eliminated */
    /* coefficients of the equations `rest` with the half-angle tangent t: the first index selects
     * 1, cos s or sin s, the second t^2, t or 1 */
    double form[3][3][6][3];
} chasles_general_system;

static void chasles_general_product(const double *a, const double *b, double *c)
{
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 4; k++) {
            c[4 * i + k] = a[4 * i] * b[k] + a[4 * i + 1] * b[4 + k] + a[4 * i + 2] * b[8 + k];
        }
        c[4 * i + 3] += a[4 * i + 3];
    }
}

static void chasles_general_inverse(const double *a, double *b)
{
    for (int i = 0; i < 3; i++) {
        b[4 * i + 3] = 0.0;
        for (int k = 0; k < 3; k++) {
            b[4 * i + k] = a[4 * k + i];
            b[4 * i + 3] -= a[4 * k + i] * a[4 * k + 3];
        }
    }
}

/* Returns whether a joint of the arm is unknown. */
static int chasles_general_is_solved(const chasles_general_arm *arm, int joint)
{
    return arm->kind[joint] == CHASLES_SOLVED_TURN || arm->kind[joint] == CHASLES_SOLVED_SLIDE;
}

/* Returns whether a joint of the arm is prismatic. */
static int chasles_general_slides(const chasles_general_arm *arm, int joint)
{
    return arm->kind[joint] == CHASLES_GIVEN_SLIDE || arm->kind[joint] == CHASLES_SOLVED_SLIDE;
}

/* Returns the number of fixed joints of an arm. */
static int chasles_general_given(const chasles_general_arm *arm)
{
    int given = 0;
    for (int k = 0; k < arm->joints; k++)
        given += !chasles_general_is_solved(arm, k);
    return given;
}

/* Computes the transform after a fixed joint from the transform before this joint. */
static void chasles_general_fixed(const chasles_general_arm *arm, int joint, double value,
                                  double *placed)
{
    const double along = arm->direction[joint] * value;
    const int turns = !chasles_general_slides(arm, joint);
    const double c = turns ? cos(along) : 1.0, s = turns ? sin(along) : 0.0;
    const double d = turns ? 0.0 : along;
    const double motion[12] = {c, -s, 0.0, 0.0, s, c, 0.0, 0.0, 0.0, 0.0, 1.0, d};
    double moved[12];
    chasles_general_product(placed, motion, moved);
    chasles_general_product(moved, arm->placed[joint + 1], placed);
}

/* Computes the arm with six unknown joints that results if the fixed joints have the given values.
 */
static void chasles_general_set(const chasles_general_arm *arm, const double *value,
                                chasles_general_six *six)
{
    const int tool = arm->joints - chasles_general_given(arm) < 6;
    int solved = 0, given = 0;
    double placed[12];
    six->arm = arm;
    six->has_slides = 0;
    six->has_tool_joint = tool;
    memcpy(placed, arm->placed[0], sizeof placed);
    for (int k = 0; k < arm->joints + tool; k++) {
        if (chasles_general_is_solved(arm, k)) {
            memcpy(six->placed[solved], placed, sizeof placed);
            six->slides[solved] = chasles_general_slides(arm, k);
            six->has_slides = six->has_slides || six->slides[solved];
            six->own[solved++] = k;
            memcpy(placed, arm->placed[k + 1], sizeof placed);
        } else {
            six->value[given] = value[given];
            chasles_general_fixed(arm, k, value[given++], placed);
        }
    }
    memcpy(six->placed[6], placed, sizeof placed);
    for (int k = 0; k < 7; k++) {
        for (int i = 0; i < 3; i++)
            six->placed[k][4 * i + 3] /= arm->length;
    }
}

static double chasles_general_direction(const chasles_general_six *six, int joint)
{
    return six->arm->direction[six->own[joint]];
}

/* Returns an angle reduced by full turns, or a prismatic coordinate unchanged. */
static double chasles_general_wrapped(const chasles_general_six *six, int joint, double value)
{
    return six->slides[joint] ? value : chasles_circle_wrapped(value);
}

/* Computes the constant transforms C_1 to C_6 of the closed loop of arm and target pose, in the
 * elimination order. */
static void chasles_general_loop(const chasles_general_six *six, const chasles_general_order *order,
                                 const double *T, double (*C)[12])
{
    double pose[12], back[12], closing[12];
    memcpy(pose, T, sizeof pose);
    for (int i = 0; i < 3; i++)
        pose[4 * i + 3] /= six->arm->length;
    chasles_general_inverse(pose, back);
    chasles_general_product(six->placed[6], back, pose);
    chasles_general_product(pose, six->placed[0], closing);
    for (int i = 0; i < 6; i++) {
        const int k = order->joint[i];
        if (order->sense > 0) {
            memcpy(C[i], k < 5 ? six->placed[k + 1] : closing, sizeof C[i]);
        } else {
            chasles_general_inverse(k > 0 ? six->placed[k] : closing, C[i]);
        }
    }
}

/* Computes the fifteen line quantities of a frame's z axis, where p is the frame's origin and l the
 * direction of the z axis. The line quantities are p, l, p . p, p . l, p x l, (p . p) l - 2 (p . l)
 * p, and 1. */
static void chasles_general_line(const double *C, double *x)
{
    const double p[3] = {C[3], C[7], C[11]}, l[3] = {C[2], C[6], C[10]};
    const double pp = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    const double pl = p[0] * l[0] + p[1] * l[1] + p[2] * l[2];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        x[i] = p[i], x[3 + i] = l[i];
        x[8 + i] = p[j] * l[k] - p[k] * l[j];
        x[11 + i] = pp * l[i] - 2.0 * pl * p[i];
    }
    x[6] = pp, x[7] = pl, x[14] = 1.0;
}

/* Computes the line quantities y (see chasles_general_line) of a line after the rigid motion C from
 * the line quantities x before this motion. */
static void chasles_general_moved(const double *C, const double *x, double *y)
{
    const double d[3] = {C[3], C[7], C[11]};
    double p[3], l[3], m[3], w[3], hp = 0.0, hl = 0.0, dd = 0.0;
    for (int i = 0; i < 3; i++) {
        const double *r = C + 4 * i;
        p[i] = r[0] * x[0] + r[1] * x[1] + r[2] * x[2];
        l[i] = r[0] * x[3] + r[1] * x[4] + r[2] * x[5];
        m[i] = r[0] * x[8] + r[1] * x[9] + r[2] * x[10];
        w[i] = r[0] * x[11] + r[1] * x[12] + r[2] * x[13];
        hp += d[i] * p[i], hl += d[i] * l[i], dd += d[i] * d[i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        y[i] = p[i] + d[i] * x[14];
        y[3 + i] = l[i];
        y[8 + i] = m[i] + (d[j] * l[k] - d[k] * l[j]);
        y[11 + i] = w[i] - 2.0 * (d[j] * m[k] - d[k] * m[j]) + dd * l[i] - 2.0 * (hl + x[7]) * d[i];
    }
    y[6] = x[6] + 2.0 * hp + dd * x[14];
    y[7] = x[7] + hl;
    y[14] = x[14];
}

/* Computes the line quantities (see chasles_general_line) of a line that is rotated about z by sign
 * * angle. Each quantity is a linear combination of 1, cos(angle) and sin(angle). The array `parts`
 * receives the coefficients of 1, cos(angle) and sin(angle), in this order. */
static void chasles_general_turned(const double *x, double sign, double (*parts)[15])
{
    static const int vectors[4] = {0, 3, 8, 11};
    memset(parts, 0, 3 * sizeof *parts);
    for (int b = 0; b < 4; b++) {
        const int k = vectors[b];
        parts[0][k + 2] = x[k + 2];
        parts[1][k] = x[k], parts[1][k + 1] = x[k + 1];
        parts[2][k] = -sign * x[k + 1], parts[2][k + 1] = sign * x[k];
    }
    parts[0][6] = x[6], parts[0][7] = x[7], parts[0][14] = x[14];
}

/* Computes the line quantities of a line that is translated by sign * d along z, as coefficients of
 * 1, d and d^2. */
static void chasles_general_slid(const double *x, double sign, double (*parts)[15])
{
    memset(parts, 0, 3 * sizeof *parts);
    memcpy(parts[0], x, sizeof *parts);
    double *once = parts[1], *twice = parts[2];
    once[2] = sign * x[14];
    once[6] = sign * 2.0 * x[2];
    once[7] = sign * x[5];
    once[8] = -sign * x[4], once[9] = sign * x[3];
    once[11] = sign * 2.0 * x[9], once[12] = -sign * 2.0 * x[8];
    once[13] = -sign * 2.0 * x[7];
    twice[6] = x[14];
    twice[11] = x[3], twice[12] = x[4], twice[13] = -x[5];
}

/* Computes the line quantities (see chasles_general_line) of a line that a joint moves. The array
 * `parts` receives the coefficients of (1, cos, sin) for a revolute joint, or of (1, d, d^2) for
 * the displacement d of a prismatic joint. */
static void chasles_general_parts(int slides, const double *x, double sign, double (*parts)[15])
{
    if (slides)
        chasles_general_slid(x, sign, parts);
    else
        chasles_general_turned(x, sign, parts);
}

/* Computes the matrix [A B] of the fourteen equations A y = B(s) x. The argument `slides` marks the
 * prismatic joints. */
static void chasles_general_rows(const double (*C)[12], const int *slides, double (*S)[36])
{
    double inverse[12], x[15], y[15], one[3][15], two[3][15], three[3][15];
    double first[12], second[12];
    chasles_general_inverse(C[5], inverse);
    chasles_general_line(inverse, x);
    chasles_general_parts(slides[0], x, -1.0, one);
    chasles_general_inverse(C[0], first);
    chasles_general_inverse(C[1], second);
    double left[9][15];
    for (int a = 0; a < 3; a++) {
        chasles_general_moved(first, one[a], y);
        chasles_general_parts(slides[1], y, -1.0, two);
        for (int b = 0; b < 3; b++)
            chasles_general_moved(second, two[b], left[3 * a + b]);
    }
    for (int i = 0; i < CHASLES_EQUATIONS; i++) {
        for (int k = 0; k < 8; k++)
            S[i][k] = left[1 + k][i];
    }
    chasles_general_line(C[4], x);
    chasles_general_parts(slides[4], x, 1.0, one);
    for (int b = 0; b < 3; b++) {
        chasles_general_moved(C[3], one[b], y);
        chasles_general_parts(slides[3], y, 1.0, two);
        for (int a = 0; a < 3; a++) {
            chasles_general_moved(C[2], two[a], y);
            chasles_general_turned(y, 1.0, three);
            for (int m = 0; m < 3; m++) {
                for (int i = 0; i < CHASLES_EQUATIONS; i++)
                    S[i][8 + 9 * m + 3 * a + b] = three[m][i];
            }
        }
    }
    for (int i = 0; i < CHASLES_EQUATIONS; i++) {
        S[i][8] -= left[0][i];
        S[i][35] = 0.0;
    }
}

/* Reduces A to triangular form by Householder reflections, which are also applied to B. */
static void chasles_general_reflect(double (*S)[36])
{
    for (int j = 0; j < 8; j++) {
        double norm = 0.0, h[CHASLES_EQUATIONS], sum[36] = {0.0};
        for (int i = j; i < CHASLES_EQUATIONS; i++)
            norm += S[i][j] * S[i][j];
        norm = copysign(sqrt(norm), S[j][j]);
        const double scale = norm * (norm + S[j][j]);
        if (scale == 0.0)
            continue;
        for (int i = j; i < CHASLES_EQUATIONS; i++)
            h[i] = S[i][j];
        h[j] += norm;
        for (int i = j; i < CHASLES_EQUATIONS; i++) {
            for (int k = 0; k < 36; k++)
                sum[k] += h[i] * S[i][k];
        }
        for (int k = 0; k < 36; k++)
            sum[k] /= scale;
        for (int i = j; i < CHASLES_EQUATIONS; i++) {
            for (int k = 0; k < 36; k++)
                S[i][k] -= h[i] * sum[k];
        }
    }
}

/* Separates the six equations that do not contain y from the eight equations that determine y. */
static void chasles_general_eliminate(const chasles_general_six *six,
                                      const chasles_general_order *order, const double *T,
                                      chasles_general_system *system)
{
    const double c0 = cos(CHASLES_HALF_FROM), s0 = sin(CHASLES_HALF_FROM);
    double S[CHASLES_EQUATIONS][36];
    chasles_general_loop(six, order, T, system->loop);
    for (int k = 0; k < 6; k++)
        system->slides[k] = six->slides[order->joint[k]];
    chasles_general_rows((const double(*)[12])system->loop, system->slides, S);
    chasles_general_reflect(S);
    for (int i = 0; i < 8; i++) {
        memcpy(system->factor[i], S[i], sizeof system->factor[i]);
        for (int m = 0; m < 3; m++)
            memcpy(system->head[m][i], S[i] + 8 + 9 * m, sizeof system->head[m][i]);
    }
    const int along = order->halved ? 1 : 3, across = order->halved ? 3 : 1;
    for (int m = 0; m < 3; m++) {
        for (int i = 0; i < 6; i++) {
            const double *row = S[8 + i] + 8 + 9 * m;
            memcpy(system->rest[m][i], row, sizeof system->rest[m][i]);
            for (int k = 0; k < 3; k++) {
                const double one = row[across * k], c = row[across * k + along];
                const double s = row[across * k + 2 * along];
                const double cosine = c0 * c + s0 * s, sine = c0 * s - s0 * c;
                system->form[m][0][i][k] = one - cosine;
                system->form[m][1][i][k] = 2.0 * sine;
                system->form[m][2][i][k] = one + cosine;
            }
        }
    }
}

#endif
