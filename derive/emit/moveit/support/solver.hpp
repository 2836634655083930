/** A kinematics plugin of MoveIt 2 over the closed-form kinematics of an exported robot.
 *
 * The code is the same for every robot. Its namespace has the name of the robot, because a process
 * may load the plugins of several robots.
 */
#ifndef CHASLES_MOVEIT_SOLVER_HPP
#define CHASLES_MOVEIT_SOLVER_HPP

#include <Eigen/Geometry>
#include <limits>
#include <string>
#include <vector>

// The headers of MoveIt end in .h up to MoveIt 2.12.
#if __has_include(<moveit/kinematics_base/kinematics_base.hpp>)
#include <moveit/kinematics_base/kinematics_base.hpp>
#include <moveit/robot_state/robot_state.hpp>
#else
#include <moveit/kinematics_base/kinematics_base.h>
#include <moveit/robot_state/robot_state.h>
#endif

namespace chasles_robot_moveit
{

using Values = std::vector<double>;
using Pose = geometry_msgs::msg::Pose;
using ErrorCode = moveit_msgs::msg::MoveItErrorCodes;
using Options = kinematics::KinematicsQueryOptions;
using Callback = kinematics::KinematicsBase::IKCallbackFn;

constexpr double FULL_TURN = 6.283185307179586; // rad
constexpr double UNLIMITED = std::numeric_limits<double>::infinity();

/** The type of the cost function in MoveIt: a value in Humble, later a reference. */
template <typename C>
C passed(bool (kinematics::KinematicsBase::*)(const std::vector<Pose> &, const Values &, double,
                                              const Values &, Values &, const Callback &, C,
                                              ErrorCode &, const Options &,
                                              const moveit::core::RobotState *) const);
using PassedCost = decltype(passed(&kinematics::KinematicsBase::searchPositionIK));

class Samples;

/** The exported functions of a robot. Poses are row-major; theta are the joints of the group. */
struct Robot {
    const char *base, *tip;  /**< links of the exported pose */
    std::size_t slots;       /**< largest number of solutions */
    Values periods;          /**< of each joint: a full turn, or 0 for a joint without one */
    Values reference;        /**< joints with closed loops; empty in a robot without loops */
    std::vector<int> inputs; /**< joint of each input of the inverse; -1 for a swivel angle */
    void (*forward)(const double *theta, double *T);
    void (*inverse)(const double *T, const double *inputs, double *theta, double *residual);
    void (*inputs_at)(const double *theta, double *inputs);
};

/** The plugin of a robot. Its const functions may be called from several threads. */
class Solver : public kinematics::KinematicsBase
{
  public:
    using kinematics::KinematicsBase::searchPositionIK;
    using kinematics::KinematicsBase::setRedundantJoints;

    bool initialize(const rclcpp::Node::SharedPtr &node,
                    const moveit::core::RobotModel &robot_model, const std::string &group_name,
                    const std::string &base_frame, const std::vector<std::string> &tip_frames,
                    double search_discretization) override;

    bool getPositionIK(const Pose &pose, const Values &seed, Values &solution, ErrorCode &code,
                       const Options &options) const override
    {
        Options locked = options;
        locked.lock_redundant_joints = true;
        return search(pose, seed, UNLIMITED, {}, solution, {}, code, locked);
    }
    bool getPositionIK(const std::vector<Pose> &poses, const Values &seed,
                       std::vector<Values> &solutions, kinematics::KinematicsResult &result,
                       const Options &options) const override;

    bool searchPositionIK(const Pose &pose, const Values &seed, double timeout, Values &solution,
                          ErrorCode &code, const Options &options) const override
    {
        return search(pose, seed, timeout, {}, solution, {}, code, options);
    }
    bool searchPositionIK(const Pose &pose, const Values &seed, double timeout,
                          const Values &limits, Values &solution, ErrorCode &code,
                          const Options &options) const override
    {
        return search(pose, seed, timeout, limits, solution, {}, code, options);
    }
    bool searchPositionIK(const Pose &pose, const Values &seed, double timeout, Values &solution,
                          const Callback &callback, ErrorCode &code,
                          const Options &options) const override
    {
        return search(pose, seed, timeout, {}, solution, callback, code, options);
    }
    bool searchPositionIK(const Pose &pose, const Values &seed, double timeout,
                          const Values &limits, Values &solution, const Callback &callback,
                          ErrorCode &code, const Options &options) const override
    {
        return search(pose, seed, timeout, limits, solution, callback, code, options);
    }
    bool searchPositionIK(const std::vector<Pose> &poses, const Values &seed, double timeout,
                          const Values &limits, Values &solution, const Callback &callback,
                          PassedCost cost_function, ErrorCode &code, const Options &options,
                          const moveit::core::RobotState *context_state) const override;

    bool getPositionFK(const std::vector<std::string> &link_names, const Values &joint_angles,
                       std::vector<Pose> &poses) const override;

    /** Accepts only the joints that are inputs of the exported inverse. */
    bool setRedundantJoints(const std::vector<unsigned int> &redundant_joint_indices) override;

    const std::vector<std::string> &getJointNames() const override
    {
        return joint_names_;
    }
    const std::vector<std::string> &getLinkNames() const override
    {
        return link_names_;
    }

  protected:
    explicit Solver(Robot robot);

  private:
    bool fail(const std::string &message) const;
    bool findJoints();
    bool findFrames();
    bool agreesWithModel() const;
    std::string link(const char *parameter, const char *exported, const std::string &own) const;

    bool accepts(const Values &seed, const Values &limits) const;
    Samples samples(const Values &seed, const Values &limits, const Options &options) const;
    std::vector<Values> solutions(const Pose &pose, const Values &seed, const Values &inputs,
                                  const Values &limits) const;
    bool search(const Pose &pose, const Values &seed, double timeout, const Values &limits,
                Values &solution, const Callback &callback, ErrorCode &code,
                const Options &options) const;
    Eigen::Isometry3d tipPose(const Values &theta) const;

    Robot robot_;
    const moveit::core::JointModelGroup *group_ = nullptr;
    std::vector<std::string> joint_names_, link_names_;
    Values lower_, upper_;
    double step_ = DEFAULT_SEARCH_DISCRETIZATION;
    /** Poses of the group's base in the robot's base, and of the robot's tip in the group's tip. */
    Eigen::Isometry3d base_ = Eigen::Isometry3d::Identity();
    Eigen::Isometry3d tip_ = Eigen::Isometry3d::Identity();
};

} // namespace chasles_robot_moveit

#endif
