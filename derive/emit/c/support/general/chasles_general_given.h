/* Inverse kinematics of an arm of any geometry with more than six joints, of which six are
 * solved for and all others given; part of chasles, the same for every such robot.
 */
#ifndef CHASLES_GENERAL_GIVEN_H
#define CHASLES_GENERAL_GIVEN_H

#include "chasles_general_solutions.h"

typedef chasles_general_arm chasles_general_given_arm;

/* Every solution of a pose at values of the given joints (rad or m), in sixteen slots. */
static void chasles_general_given_ik(const chasles_general_given_arm *arm, const double *T,
                                     const double *value, double *q, double *residual,
                                     double *margin)
{
    chasles_general_slots(arm, value, T, q, residual, margin);
}

#endif
