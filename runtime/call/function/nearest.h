/* Nearest: the Python class of the object robot.ik_nearest.
 *
 * C code handles calls whose only arguments are poses and seeds. Python handles calls with options,
 * poses that need refinement, and matrices that are not poses. */
#pragma once

#include "call/function/function.h"

extern PyTypeObject NearestType;
