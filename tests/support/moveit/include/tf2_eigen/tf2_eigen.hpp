/** Stub of the conversion from Eigen to messages. */
#ifndef STUB_TF2_EIGEN_HPP
#define STUB_TF2_EIGEN_HPP

#include <Eigen/Geometry>
#include <moveit/kinematics_base/kinematics_base.hpp>

namespace tf2
{
inline geometry_msgs::msg::Pose toMsg(const Eigen::Isometry3d &T)
{
    const Eigen::Vector3d at = T.translation();
    const Eigen::Quaterniond turn(T.linear());
    return {{at.x(), at.y(), at.z()}, {turn.x(), turn.y(), turn.z(), turn.w()}};
}
} // namespace tf2

#endif
