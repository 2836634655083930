/** Stubs of ROS 2 and of the base class of MoveIt 2: declarations that a kinematics plugin needs.
 */
#ifndef STUB_KINEMATICS_BASE_HPP
#define STUB_KINEMATICS_BASE_HPP

#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#define RCLCPP_ERROR(logger, ...) (std::snprintf((logger).text, sizeof(logger).text, __VA_ARGS__))

namespace rclcpp
{
struct Logger {
    char (&text)[400]; // the last message
};
inline Logger get_logger(const std::string &)
{
    static char text[400];
    return {text};
}
class Parameter
{
  public:
    const std::string &as_string() const
    {
        return text;
    }
    std::string text;
};
class Node
{
  public:
    using SharedPtr = std::shared_ptr<Node>;
    bool has_parameter(const std::string &name) const
    {
        return parameters.count(name) > 0;
    }
    Parameter get_parameter(const std::string &name) const
    {
        return {parameters.at(name)};
    }
    template <typename T> T declare_parameter(const std::string &name, const T &value)
    {
        return parameters[name] = value;
    }
    std::map<std::string, std::string> parameters;
};
} // namespace rclcpp

namespace geometry_msgs::msg
{
struct Pose {
    struct {
        double x = 0, y = 0, z = 0;
    } position;
    struct {
        double x = 0, y = 0, z = 0, w = 1;
    } orientation;
};
} // namespace geometry_msgs::msg

namespace moveit_msgs::msg
{
struct MoveItErrorCodes {
    enum { SUCCESS = 1, TIMED_OUT = -6, NO_IK_SOLUTION = -31 };
    int val = 0;
};
} // namespace moveit_msgs::msg

namespace moveit::core
{
class JointModelGroup;
class RobotModel;
class RobotState;
using RobotModelConstPtr = std::shared_ptr<const RobotModel>;
} // namespace moveit::core

namespace kinematics
{
namespace DiscretizationMethods
{
enum DiscretizationMethod {
    NO_DISCRETIZATION = 1,
    ALL_DISCRETIZED,
    SOME_DISCRETIZED,
    ALL_RANDOM_SAMPLED,
    SOME_RANDOM_SAMPLED
};
}
using DiscretizationMethod = DiscretizationMethods::DiscretizationMethod;
namespace KinematicErrors
{
enum KinematicError {
    OK = 1,
    UNSUPORTED_DISCRETIZATION_REQUESTED,
    DISCRETIZATION_NOT_INITIALIZED,
    MULTIPLE_TIPS_NOT_SUPPORTED,
    EMPTY_TIP_POSES,
    IK_SEED_OUTSIDE_LIMITS,
    SOLVER_NOT_ACTIVE,
    NO_SOLUTION
};
}
using KinematicError = KinematicErrors::KinematicError;

struct KinematicsQueryOptions {
    bool lock_redundant_joints = false, return_approximate_solution = false;
    DiscretizationMethod discretization_method = DiscretizationMethods::NO_DISCRETIZATION;
};
struct KinematicsResult {
    KinematicError kinematic_error;
    double solution_percentage;
};

namespace stub
{
using Pose = geometry_msgs::msg::Pose;
using Values = std::vector<double>;
using Code = moveit_msgs::msg::MoveItErrorCodes;
using Options = KinematicsQueryOptions;
} // namespace stub

class KinematicsBase
{
  public:
    static constexpr double DEFAULT_SEARCH_DISCRETIZATION = 0.1;
    using IKCallbackFn =
        std::function<void(const stub::Pose &, const stub::Values &, stub::Code &)>;
    using IKCostFn =
        std::function<double(const stub::Pose &, const moveit::core::RobotState &,
                             const moveit::core::JointModelGroup *, const stub::Values &)>;

    virtual ~KinematicsBase() = default;
    virtual bool getPositionIK(const stub::Pose &, const stub::Values &, stub::Values &,
                               stub::Code &, const stub::Options & = stub::Options()) const = 0;
    virtual bool getPositionIK(const std::vector<stub::Pose> &, const stub::Values &,
                               std::vector<stub::Values> &, KinematicsResult &,
                               const stub::Options &) const = 0;
    virtual bool searchPositionIK(const stub::Pose &, const stub::Values &, double, stub::Values &,
                                  stub::Code &, const stub::Options & = stub::Options()) const = 0;
    virtual bool searchPositionIK(const stub::Pose &, const stub::Values &, double,
                                  const stub::Values &, stub::Values &, stub::Code &,
                                  const stub::Options & = stub::Options()) const = 0;
    virtual bool searchPositionIK(const stub::Pose &, const stub::Values &, double, stub::Values &,
                                  const IKCallbackFn &, stub::Code &,
                                  const stub::Options & = stub::Options()) const = 0;
    virtual bool searchPositionIK(const stub::Pose &, const stub::Values &, double,
                                  const stub::Values &, stub::Values &, const IKCallbackFn &,
                                  stub::Code &, const stub::Options & = stub::Options()) const = 0;
    // As in MoveIt, a single pose takes the functions for one pose, and other numbers fail.
    virtual bool searchPositionIK(const std::vector<stub::Pose> &poses, const stub::Values &seed,
                                  double timeout, const stub::Values &limits,
                                  stub::Values &solution, const IKCallbackFn &callback,
                                  stub::Code &code, const stub::Options &options = stub::Options(),
                                  const moveit::core::RobotState * = nullptr) const
    {
        if (poses.size() != 1) {
            return false;
        }
        return callback
                   ? searchPositionIK(poses[0], seed, timeout, limits, solution, callback, code,
                                      options)
                   : searchPositionIK(poses[0], seed, timeout, limits, solution, code, options);
    }
    // As in MoveIt, a plugin that does not override this function supports no cost function.
    virtual bool searchPositionIK(const std::vector<stub::Pose> &poses, const stub::Values &seed,
                                  double timeout, const stub::Values &limits,
                                  stub::Values &solution, const IKCallbackFn &callback,
                                  const IKCostFn &cost, stub::Code &code,
                                  const stub::Options &options = stub::Options(),
                                  const moveit::core::RobotState *state = nullptr) const
    {
        return !cost && searchPositionIK(poses, seed, timeout, limits, solution, callback, code,
                                         options, state);
    }
    virtual bool getPositionFK(const std::vector<std::string> &, const stub::Values &,
                               std::vector<stub::Pose> &) const = 0;
    virtual bool initialize(const rclcpp::Node::SharedPtr &, const moveit::core::RobotModel &,
                            const std::string &, const std::string &,
                            const std::vector<std::string> &, double) = 0;
    virtual bool setRedundantJoints(const std::vector<unsigned int> &joints)
    {
        redundant_joint_indices_ = joints;
        setSearchDiscretization(DEFAULT_SEARCH_DISCRETIZATION);
        return true;
    }
    bool setRedundantJoints(const std::vector<std::string> &)
    {
        return false;
    }
    virtual const std::vector<std::string> &getJointNames() const = 0;
    virtual const std::vector<std::string> &getLinkNames() const = 0;
    void setSearchDiscretization(double step)
    {
        redundant_joint_discretization_.clear();
        for (const unsigned int joint : redundant_joint_indices_) {
            redundant_joint_discretization_[static_cast<int>(joint)] = step;
        }
    }
    double getSearchDiscretization(int joint = 0) const
    {
        const auto found = redundant_joint_discretization_.find(joint);
        return found == redundant_joint_discretization_.end() ? 0 : found->second;
    }

  protected:
    void storeValues(const moveit::core::RobotModel &model, const std::string &group,
                     const std::string &base, const std::vector<std::string> &tips, double step)
    {
        robot_model_ = {&model, [](const moveit::core::RobotModel *) {}};
        group_name_ = group;
        base_frame_ = base;
        tip_frames_ = tips;
        setSearchDiscretization(step);
    }

    rclcpp::Node::SharedPtr node_;
    moveit::core::RobotModelConstPtr robot_model_;
    std::string group_name_, base_frame_;
    std::vector<std::string> tip_frames_;
    std::vector<unsigned int> redundant_joint_indices_;
    std::map<int, double> redundant_joint_discretization_;
    std::vector<DiscretizationMethod> supported_methods_ = {
        DiscretizationMethods::NO_DISCRETIZATION};
};
} // namespace kinematics

#endif
