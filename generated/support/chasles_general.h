/* Inverse kinematics of an arm of six joints of any geometry; part of chasles, the same for every
 * such robot.
 */
#ifndef CHASLES_GENERAL_H
#define CHASLES_GENERAL_H

#include "chasles_general_solutions.h"

/* Every solution of a pose in sixteen slots. */
static void chasles_general_ik(const chasles_general_arm *arm, const double *T, double *q,
                               double *residual, double *margin)
{
    chasles_general_slots(arm, NULL, T, q, residual, margin);
}

#endif
