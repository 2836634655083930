/* Inverse kinematics of an arm of any geometry, of which six joints are solved for and all others
 * given; part of chasles, the same for every such robot.
 */
#ifndef CHASLES_GENERAL_H
#define CHASLES_GENERAL_H

#include "chasles_general_solutions.h"

/* Every solution of a pose in sixteen slots, at values of the given joints (rad or m); NULL where
 * none is given. */
static void chasles_general_ik(const chasles_general_arm *arm, const double *T, const double *value,
                               double *q, double *residual, double *margin)
{
    chasles_general_slots(arm, value, T, q, residual, margin);
}

#endif
