/** Stubs of MoveIt's robot model and state: a tree of links with joints of one position. */
#ifndef STUB_ROBOT_STATE_HPP
#define STUB_ROBOT_STATE_HPP

#include <Eigen/Geometry>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace moveit::core
{
class LinkModel;

struct VariableBounds {
    double min_position_, max_position_;
    bool position_bounded_;
};

class JointModel
{
  public:
    enum JointType { UNKNOWN, REVOLUTE, PRISMATIC, PLANAR, FLOATING, FIXED };
    const std::string &getName() const
    {
        return name;
    }
    JointType getType() const
    {
        return type;
    }
    std::size_t getVariableCount() const
    {
        return type == FIXED ? 0 : 1;
    }
    const JointModel *getMimic() const
    {
        return mimic;
    }
    const LinkModel *getParentLinkModel() const
    {
        return parent;
    }

    std::string name;
    JointType type = FIXED;
    Eigen::Isometry3d origin;
    Eigen::Vector3d axis;
    VariableBounds bounds;
    const LinkModel *parent = nullptr;
    const JointModel *mimic = nullptr;
    double multiplier = 0;
};

class LinkModel
{
  public:
    const std::string &getName() const
    {
        return name;
    }
    const JointModel *getParentJointModel() const
    {
        return joint;
    }

    std::string name;
    const JointModel *joint = nullptr;
};

class JointModelGroup
{
  public:
    const std::vector<std::string> &getActiveJointModelNames() const
    {
        return joints;
    }
    const std::vector<std::string> &getLinkModelNames() const
    {
        return links;
    }
    bool isSingleDOFJoints() const
    {
        return true;
    }

    std::vector<std::string> joints, links;
};

class RobotModel
{
  public:
    bool hasLinkModel(const std::string &name) const
    {
        return links.count(name) > 0;
    }
    const LinkModel *getLinkModel(const std::string &name) const
    {
        return hasLinkModel(name) ? &links.at(name) : nullptr;
    }
    const JointModelGroup *getJointModelGroup(const std::string &name) const
    {
        return name == "arm" ? &group : nullptr;
    }
    const VariableBounds &getVariableBounds(const std::string &name) const
    {
        return joints.at(name).bounds;
    }
    static const LinkModel *getRigidlyConnectedParentLinkModel(const LinkModel *link)
    {
        while (link->joint && link->joint->type == JointModel::FIXED) {
            link = link->joint->parent;
        }
        return link;
    }

    std::map<std::string, LinkModel> links;
    std::map<std::string, JointModel> joints;
    JointModelGroup group;
};

class RobotState
{
  public:
    explicit RobotState(std::shared_ptr<const RobotModel> model) : model_(std::move(model))
    {
    }
    void setToDefaultValues()
    {
        positions_.clear();
    }
    void setToRandomPositions()
    {
        for (const auto &[name, joint] : model_->joints) {
            positions_[name] = static_cast<double>(std::rand()) / RAND_MAX;
        }
    }
    void setVariablePositions(const std::vector<std::string> &names,
                              const std::vector<double> &positions)
    {
        for (std::size_t k = 0; k < names.size(); ++k) {
            positions_[names[k]] = positions[k];
        }
    }
    double getVariablePosition(const std::string &name) const
    {
        const auto found = positions_.find(name);
        return found == positions_.end() ? 0 : found->second;
    }
    void update()
    {
    }
    Eigen::Isometry3d getGlobalLinkTransform(const std::string &name) const
    {
        const LinkModel *link = model_->getLinkModel(name);
        if (!link->joint) {
            return Eigen::Isometry3d::Identity();
        }
        const JointModel &joint = *link->joint;
        const double position = joint.mimic
                                    ? joint.multiplier * getVariablePosition(joint.mimic->name)
                                    : getVariablePosition(joint.name);
        Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
        if (joint.type == JointModel::REVOLUTE) {
            motion.linear() = Eigen::AngleAxisd(position, joint.axis).toRotationMatrix();
        } else if (joint.type == JointModel::PRISMATIC) {
            motion.translation() = position * joint.axis;
        }
        return getGlobalLinkTransform(joint.parent->name) * joint.origin * motion;
    }

  private:
    std::shared_ptr<const RobotModel> model_;
    std::map<std::string, double> positions_;
};
} // namespace moveit::core

#endif
