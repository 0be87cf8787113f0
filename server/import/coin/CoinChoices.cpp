// Groups that show some of their children: Switch, LOD, LevelOfDetail. All are walked.

#include <Inventor/VRMLnodes/SoVRML.h>
#include <Inventor/VRMLnodes/SoVRMLNodes.h>
#include <Inventor/elements/SoModelMatrixElement.h>
#include <Inventor/misc/SoChildList.h>
#include <Inventor/nodes/SoNodes.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/import/coin/CoinNodes.h"
#include "server/import/coin/CoinWalk.h"

namespace tessera {
namespace {

/// Of so many levels. Whether some were not good.
bool keepGoodRanges(std::vector<double>& ranges, std::size_t levels, bool descend) {
    constexpr std::size_t kMostLevels = 256;
    std::size_t good = 0;
    for (; good < ranges.size() && std::isfinite(ranges[good]); ++good) {
        const bool isFirst = good == 0;
        if (descend ? ranges[good] < 0 || (!isFirst && ranges[good] >= ranges[good - 1])
                    : ranges[good] <= (isFirst ? 0.0 : ranges[good - 1]))
            break;
    }
    const bool some = good < ranges.size();
    ranges.resize(std::min({good, levels == 0 ? 0 : levels - 1, kMostLevels - 1}));
    return some;
}

/// Inventor counts the pixels of the rectangle around a box on the screen, we the diameter of a sphere. Its sphere has
/// the diameter d = √((ab + bc + ca) / 3) of the sides a, b, c: seen along its three axes, the box then covers d² on
/// the mean, and an area A becomes the diameter √A. 0: there is no box, or none with an area.
double radiusBySides(const Box& box) {
    if (box.empty()) return 0;
    const Vec3d s = box.size();
    const double diameter = std::sqrt((s.x() * s.y() + s.y() * s.z() + s.z() * s.x()) / 3);
    return diameter <= 1e15 ? diameter / 2 : 0;
}

}  // namespace

void CoinWalk::extendBounds(const Box& box, const Affine3d& world) {
    bounds_.extend(box.transformed(world));
    for (Measured& group : measured_) group.box.extend(box.transformed(Affine3d(group.group_T_world * world)));
}

Expected<void> CoinWalk::visitAsOne(SoNode& child, std::size_t index, Opened& in) {
    const int before = in.node->node_size();
    if (Expected<void> done = visit(child, in.place); !done) return done;
    if (in.node->node_size() == before) make(fmt::format("nothing {}", index), in.place);
    return {};
}

Expected<void> CoinWalk::addSwitch(SoNode& node, Place& at) {
    SoState& state = *action_.getState();
    int chosen = -1;
    std::vector<SoNode*> children;
    const bool vrml2 = is<SoVRMLSwitch>(node);
    if (vrml2) {
        auto& choice = static_cast<SoVRMLSwitch&>(node);
        chosen = choice.whichChoice.getValue();
        for (int i = 0; i < choice.choice.getNum(); ++i) children.push_back(choice.choice[i]);
    } else {
        auto& choice = static_cast<SoSwitch&>(node);
        chosen = choice.whichChild.getValue();
        for (int i = 0; i < choice.getNumChildren(); ++i) children.push_back(choice.getChild(i));
    }
    const bool all = chosen == SO_SWITCH_ALL;
    // Of Inventor's what is chosen may be properties, which hold for what follows.
    const auto onlyProperties = [](const SoNode* child) {
        return child->getChildren() == nullptr && !is<SoShape>(*child) && !is<SoVRMLShape>(*child);
    };
    if (!vrml2 && std::ranges::all_of(children, onlyProperties)) {
        for (std::size_t i = 0; i < children.size(); ++i)
            if (all || static_cast<int>(i) == chosen)
                if (Expected<void> done = visit(*children[i], at); !done) return done;
        return {};
    }
    const SbMatrix outside = SoModelMatrixElement::get(&state);
    Expected<Opened> opened = open(node, "Switch", at);
    if (!opened || opened->node == nullptr) return opened ? Expected<void>() : tl::unexpected(opened.error());
    Message* const shown = opened->node->add_node();
    shown->set_name("choice");
    shown->mutable_switch_()->set_choice(all ? -1 : chosen < 0 ? -2 : chosen);
    Opened in{shown,
              {},
              {[shown] { return shown->add_node(); }, opened->place.path + "/choice", opened->place.world, nullptr,
               opened->place.depth + 1}};
    in.place.names = &in.names;
    for (std::size_t i = 0; i < children.size(); ++i) {
        const bool leaks = !vrml2 && (all || static_cast<int>(i) == chosen);
        const SoNode* const texture = texture_;
        if (!leaks) state.push();
        Expected<void> done = visitAsOne(*children[i], i, in);
        if (!leaks) {
            state.pop();
            texture_ = texture;
        }
        if (!done) return done;
    }
    SbMatrix inside = SoModelMatrixElement::get(&state);
    SoModelMatrixElement::set(&state, &node, inside.multRight(outside));
    return {};
}

Expected<void> CoinWalk::addLevels(SoNode& node, Place& at) {
    SoState& state = *action_.getState();
    std::vector<SoNode*> levels;
    std::vector<double> ranges;
    SbVec3f center(0, 0, 0);
    const bool byArea = is<SoLevelOfDetail>(node);
    const auto take = [&](const SoMFFloat& field) {
        for (int i = 0; i < field.getNum(); ++i) ranges.push_back(field[i]);
    };
    if (is<SoVRMLLOD>(node)) {
        auto& lod = static_cast<SoVRMLLOD&>(node);
        for (int i = 0; i < lod.level.getNum(); ++i) levels.push_back(lod.level[i]);
        take(lod.range);
        center = lod.center.getValue();
    } else {
        const SoChildList* const children = node.getChildren();
        for (int i = 0; i < children->getLength(); ++i) levels.push_back((*children)[i]);
        if (byArea) {
            take(static_cast<SoLevelOfDetail&>(node).screenArea);
            for (double& area : ranges) area = std::sqrt(area);
        } else {
            take(static_cast<SoLOD&>(node).range);
            center = static_cast<SoLOD&>(node).center.getValue();
        }
    }
    if (keepGoodRanges(ranges, levels.size(), byArea))
        scene_.note(byArea ? "areas of a LevelOfDetail that do not descend are left out, with their levels"
                           : "ranges of a LOD that do not ascend are left out, with their levels");
    if (levels.size() > ranges.size() + 1) {
        if (ranges.empty())
            scene_.note("a LOD without ranges shows its first level");
        else
            scene_.note("levels of a LOD beyond its ranges are left out");
        levels.resize(ranges.size() + 1);
    }
    state.push();
    const SoNode* const texture = texture_;
    Expected<Opened> opened = open(node, "LOD", at);
    Expected<void> done;
    if (!opened) done = tl::unexpected(opened.error());
    if (opened && opened->node != nullptr) {
        Message* const lod = opened->node->add_node();
        lod->set_name("levels");
        Opened in{lod,
                  {},
                  {[lod] { return lod->add_node(); }, opened->place.path + "/levels", opened->place.world, nullptr,
                   opened->place.depth + 1}};
        in.place.names = &in.names;
        if (byArea) measured_.push_back({opened->place.world.inverse(Eigen::Affine), {}});
        for (std::size_t i = 0; done && i < levels.size(); ++i) {
            state.push();
            done = visitAsOne(*levels[i], i, in);
            state.pop();
            texture_ = texture;
        }
        proto::scene::DistanceLOD& core = *lod->mutable_distance_lod();
        for (const double range : ranges) core.add_range(range);
        if (!byArea) {
            setVector(*core.mutable_center(), center);
        } else {
            const Box box = measured_.back().box;
            measured_.pop_back();
            if (const double radius = radiusBySides(box); radius > 0) {
                core.set_measure(proto::scene::DistanceLOD::SIZE);
                core.set_radius(radius);
                const Vec3d middle = box.center();
                setVector(*core.mutable_center(), SbVec3f(Vec3f(middle.cast<float>()).data()));
            } else {
                // Nothing to be measured: as there are no areas.
                core.clear_range();
                scene_.note("a LevelOfDetail of no size shows its finest level");
            }
        }
    }
    state.pop();
    return done;
}

}  // namespace tessera
