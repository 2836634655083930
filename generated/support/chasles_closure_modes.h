/* Rejects inverse kinematics solutions whose assembly mode differs from the mode of forward
 * kinematics, for platforms whose loops are closed by iteration. This file is part of chasles and
 * is the same for every robot.
 *
 * At the coordinates q of a solution, the platform's legs reach the target pose, and forward
 * kinematics returns the pose on the reference branch. The target pose and the pose from forward
 * kinematics are equal unless they belong to different assembly modes. */
#ifndef CHASLES_CLOSURE_MODES_H
#define CHASLES_CLOSURE_MODES_H

#include <math.h>

#include "chasles_closure_tolerances.h"

/* Moves the angles q (n,) of a solution by full turns to within half a turn of the reference
 * angles. */
static inline void chasles_mode_turns(double *q, const double *angles, int n)
{
    const double turn = 6.283185307179586;
    for (int j = 0; j < n; j++) {
        if (angles[j] == angles[j])
            q[j] -= turn * rint((q[j] - angles[j]) / turn);
    }
}

/* Returns the residual of a solution: the larger of the leg error and the distance between the
 * target pose T and the pose from forward kinematics. The residual is infinite if forward
 * kinematics returns another assembly mode. The residual is NaN if forward kinematics fails. */
static inline double chasles_mode_residual(const double T[16], const double reached[16],
                                           double legs, double size)
{
    double distance2 = 0.0, turned2 = 0.0;
    for (int i = 0; i < 12; i++) {
        const double apart = reached[i] - T[i];
        if (i % 4 == 3)
            distance2 += apart * apart;
        else
            turned2 += apart * apart / 2.0;
    }
    const double distance = sqrt(distance2), angle = sqrt(turned2);
    const int is_near = distance <= CLOSURE_SAME_MODE * size && angle <= CLOSURE_SAME_MODE;
    if (!is_near && legs <= CLOSURE_ON_LEGS * size)
        return INFINITY;
    const double residual = distance > angle ? distance : angle;
    /* A NaN residual propagates, because comparisons with NaN are false. */
    return legs > residual ? legs : residual;
}

#endif
