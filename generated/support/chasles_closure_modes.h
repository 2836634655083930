/* Assembly modes of an inverse through iterated loops; part of chasles, the same for every robot.
 *
 * The legs of a platform reach a pose with coordinates q, and fk(q) is the pose that the loops have
 * on the branch of the reference. Both are the same pose, or two assembly modes. */
#ifndef CHASLES_CLOSURE_MODES_H
#define CHASLES_CLOSURE_MODES_H

#include <math.h>

#include "chasles_closure_tolerances.h"

/* The residual of a slot whose legs miss the pose T by `legs` and whose fk is `reached`, NaN where
 * fk does not get there: infinite in another assembly mode, else the larger of both deviations.
 * Lengths count in parts of the robot's size where modes are told apart. */
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
    /* NaN is kept: a comparison with it is false. */
    return legs > residual ? legs : residual;
}

#endif
