/** The headers of MoveIt, which end in .h up to MoveIt 2.12. */
#ifndef CHASLES_MOVEIT_ROBOT_STATE_HPP
#define CHASLES_MOVEIT_ROBOT_STATE_HPP

#if __has_include(<moveit/kinematics_base/kinematics_base.hpp>)
#include <moveit/kinematics_base/kinematics_base.hpp>
#include <moveit/robot_state/robot_state.hpp>
#else
#include <moveit/kinematics_base/kinematics_base.h>
#include <moveit/robot_state/robot_state.h>
#endif

#endif
