/* Nearest: the Python class of the object robot.ik_nearest.
 *
 * If a call has only poses and seeds, C runs the inverse and selects the nearest solutions. Python
 * handles calls with options, poses that need refinement, and matrices that are not poses. */
#pragma once

#include "call/function/function.h"

extern PyTypeObject NearestType;
