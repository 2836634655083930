/* Solves for the joints before the legs of a platform and for the joints on the platform. Each leg
 * keeps a ball joint in a plane. Examples of such mechanisms are a 3-RPS platform on a rail and a
 * 3-RPS platform that carries an arm. This file is part of chasles and is the same for every robot.
 *
 * Let r_i be a plane (unit normal and negative offset), and b_i the ball joint on the platform that
 * stays in this plane. Let T be the tool pose. The matrices A_1 to A_m are the inverse transforms
 * of the joints before the legs, and A_(m+1) to A_n of the joints on the platform. The ball
 * joints are in their planes if
 *
 *     r_i . A_m ... A_1 T A_n ... A_(m+1) b_i = 0,   i = 1, 2, 3.
 *
 * The inverse transform of a revolute joint is linear in (1, cos, sin) of its angle. The inverse
 * transform of a prismatic joint is linear in (1, x), where x is its displacement. Up to three
 * joints are unknown. The equations are linear in the inverse transform of each unknown joint.
 * Therefore, the unknown joints are eliminated one after the other:
 *
 * - one angle: the least-squares solution of the equations;
 * - two angles: the 3 x 3 determinant of the equations in (1, cos, sin) of the first angle is a
 *   trigonometric polynomial of degree 3 in the second;
 * - three angles: the 8 x 8 Dixon determinant of the first two angles is a trigonometric polynomial
 *   of degree up to 24 in the third, which is sampled.
 * The equations contain no product of displacements. If two displacements and an angle are unknown,
 * the angle is a zero of a 3 x 3 determinant, which has degree 3 in this angle. If one displacement
 * and two angles are unknown, the displacement is eliminated: linearly if its coefficients are
 * constant, otherwise by a 4 x 4 Dixon determinant. Newton's iteration refines the values of all
 * unknown joints.
 */
#ifndef CHASLES_CARRIED_ARM_H
#define CHASLES_CARRIED_ARM_H

#include <math.h>

#include "chasles_carried_dixon.h"
#include "chasles_carried_elimination.h"

/* Solves for the unknown joints, and writes all solutions to `found`. */
static void chasles_arm_solved(const chasles_arm_equations *equations, chasles_arm_solutions *found)
{
    const chasles_carried_arm_arm *arm = equations->arm;
    const int slides = arm->slides, angles = arm->unknown - slides;
    double x[CHASLES_ARM_UNKNOWN] = {0.0}, rows[3][3], values[3];
    chasles_arm_pair pair;
    found->count = 0;
    if (arm->dixon) {
        chasles_arm_three(equations, found);
        return;
    }
    if (slides == 2)
        chasles_arm_columns(equations, &pair);
    else if (slides && angles == 2)
        chasles_arm_without_slide(equations, &pair);
    else
        chasles_arm_at(equations, 0.0, &pair);
    if (angles == 2) {
        chasles_arm_pairs(equations, &pair, slides, x, found);
    } else if (angles && slides) {
        chasles_arm_pairs(equations, &pair, slides - 1, x, found);
    } else if (angles) {
        for (int i = 0; i < pair.count; i++)
            for (int a = 0; a < 3; a++)
                rows[i][a] = pair.at[i][a][0];
        const int count = chasles_arm_angles(pair.count, (const double(*)[3])rows, values);
        for (int i = 0; i < count; i++) {
            x[0] = values[i];
            chasles_arm_finish(equations, x, found);
        }
    } else {
        chasles_arm_finish(equations, x, found);
    }
}

/* Writes every inverse-kinematics solution for a tool pose to the solution slots, and NaN to unused
 * slots. */
static void chasles_carried_arm_ik(const chasles_carried_arm_arm *arm, const double *T,
                                   const double *given, double *q, double *residual, double *margin)
{
    chasles_arm_equations equations;
    chasles_arm_solutions found;
    const int slots = arm->slots, n = arm->coordinates;
    found.count = 0;
    if (chasles_arm_setup(arm, T, given, &equations))
        chasles_arm_solved(&equations, &found);
    chasles_carried_unused(slots * found.count, slots * arm->solutions, n, q, residual, margin);
    for (int k = 0; k < found.count; k++) {
        const chasles_arm_solution *solution = &found.solution[k];
        double v[CHASLES_ARM_JOINTS];
        for (int map = 0; map < arm->joints; map++) {
            const int rank = arm->ranks[map];
            v[arm->places[map]] = rank < 0 ? given[-1 - rank] : solution->x[rank];
        }
        arm->legs(T, v, q + slots * n * k, residual + slots * k, margin + slots * k);
        chasles_carried_reached(arm->fk, T, arm->size, solution->margin, slots, n,
                                q + slots * n * k, residual + slots * k, margin + slots * k);
    }
}

#endif
