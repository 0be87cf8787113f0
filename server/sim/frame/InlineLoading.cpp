#include "server/sim/frame/InlineLoading.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/cores/LoadWords.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// The node below the root that a node hangs below, or is; none: it hangs nowhere.
ObjectId topOf(const Aspect& scene, ObjectId node) {
    ObjectId top;
    for (const Node* at = scene.get<Node>(node); at && at->parent; at = scene.get<Node>(node))
        top = std::exchange(node, at->parent);
    return node == kRootNode ? top : ObjectId();
}

}  // namespace

void InlineLoading::ended(ObjectId core, const std::optional<std::string>& problem) {
    if (core == underWay_) underWay_ = {};
    if (problem) failed_[core] = *problem;
}

InlineLoading::InlineLoading(const Wall& wall) {
    for (const Tile& tile : layoutTiles(wall)) {
        const auto screen = std::ranges::find(wall.screens, tile.screen, &Screen::name);
        const auto user = std::ranges::find(wall.users, tile.user, &User::name);
        if (screen == wall.screens.end() || user == wall.users.end()) continue;
        const auto known = [&](const auto& looker) {
            return looker.first.name == tile.screen && looker.second.name == tile.user;
        };
        if (std::ranges::none_of(lookers_, known)) lookers_.emplace_back(*screen, *user);
    }
}

std::vector<Vec3d> InlineLoading::headsIn(const View& view) const {
    std::vector<Vec3d> heads;
    for (const auto& [screen, user] : lookers_) {
        const User* known = view.findUser(user.name);
        const Vec3d head = screenCamera(screen, known ? *known : user, Eye::kCenter, view).headWorld;
        if (std::ranges::find(heads, head) == heads.end()) heads.push_back(head);
    }
    return heads;
}

ChangeList InlineLoading::advance(const Aspect& scene, const InlineContents& inlines, const View& view) {
    ChangeListBuilder edits;
    for (const auto& [core, problem] : failed_) {
        const std::optional<LoadWish> wish = loadWishOf(scene.find(core));
        // Whoever has changed it meanwhile does not want to know.
        if (wish && wish->state == LoadWords::kLoading)
            setLoadState(edits, core, wish->type, LoadWords::kFailed, problem);
    }
    const std::map<ObjectId, std::string> said = std::exchange(failed_, {});
    const std::set<ObjectId>& pending = inlines.pending();
    if (pending.empty() || underWay_ || order_) return edits.take();
    std::optional<std::vector<Vec3d>> heads;
    std::set<ObjectId> full;  // looked at once a frame
    auto next = pending.upper_bound(last_);
    for (std::size_t looked = std::min(pending.size(), kPerFrame); looked > 0 && !order_; --looked, ++next) {
        if (next == pending.end()) next = pending.begin();
        last_ = *next;
        ++work_;
        const LoadWish wish = *loadWishOf(scene.find(last_));
        if (said.contains(last_)) continue;
        if (!heads && wish.load == LoadWords::kNear && !wish.wanted) heads = headsIn(view);
        Judged judged = judge(scene, inlines, last_, heads ? *heads : std::vector<Vec3d>());
        if (!judged.wanted) {
            // It was on its way where nobody goes on with it.
            if (wish.state == LoadWords::kLoading) setLoadState(edits, last_, wish.type, LoadWords::kWaiting);
            continue;
        }
        if (judged.problem.empty() && (full.contains(judged.top) || isFull(scene, inlines, judged.top))) {
            full.insert(judged.top);
            judged.problem = fmt::format("{} Inlines below '{}' have content already, and no more may", kMostBrought,
                                         scene.get<Node>(judged.top)->name);
        }
        if (!judged.problem.empty()) {
            setLoadState(edits, last_, wish.type, LoadWords::kFailed, judged.problem);
            continue;
        }
        if (wish.state != LoadWords::kLoading) setLoadState(edits, last_, wish.type, LoadWords::kLoading);
        order_ = std::move(judged.order);
        underWay_ = last_;
        if (brought_.size() >= forgetAt_) {
            std::erase_if(brought_, [&](const auto& below) { return !scene.get<Node>(below.first); });
            forgetAt_ = 2 * brought_.size() + 64;
        }
        brought_[judged.top].insert(last_);
    }
    return edits.take();
}

bool InlineLoading::isFull(const Aspect& scene, const InlineContents& inlines, ObjectId top) {
    if (inlines.there().size() < kMostBrought) return false;
    if (inlines.moves() != counted_) {
        counted_ = inlines.moves();
        brought_.clear();
        for (const ObjectId core : inlines.there())
            for (const ObjectId bearer : inlines.bearersOf(core)) {
                ++work_;
                if (const ObjectId above = topOf(scene, bearer)) brought_[above].insert(core);
            }
    }
    const auto known = brought_.find(top);
    if (known == brought_.end() || known->second.size() < kMostBrought) return false;
    // Once it looks full: what has gone, or let its content go, counts no more.
    std::erase_if(known->second, [&](ObjectId core) {
        ++work_;
        return !inlines.there().contains(core);
    });
    return known->second.size() >= kMostBrought;
}

InlineLoading::Judged InlineLoading::judge(const Aspect& scene, const InlineContents& inlines, ObjectId core,
                                           const std::vector<Vec3d>& heads) const {
    Judged judged;
    const LoadWish wish = *loadWishOf(scene.find(core));
    const std::set<ObjectId>& bearers = inlines.bearersOf(core);
    if (bearers.empty()) return judged;
    const ObjectId bearer = *bearers.begin();
    std::vector<std::string> chain;
    ObjectId top = bearer;
    for (const Node* node = scene.get<Node>(bearer); node->parent; node = scene.get<Node>(top)) {
        judged.top = top;
        top = node->parent;
        const Node& above = *scene.get<Node>(top);
        if (const std::optional<LoadWish> outer = above.core ? loadWishOf(scene.find(above.core)) : std::nullopt)
            chain.emplace_back(outer->file);
    }
    if (top != kRootNode) return judged;
    judged.wanted = wish.wanted || wish.load == LoadWords::kAtOnce;
    if (!judged.wanted && wish.load == LoadWords::kNear) {
        const Affine3d world_T_node = worldTransform(scene, bearer);
        const Affine3d node_T_world = world_T_node.inverse();
        for (const Vec3d& head : heads) {
            // Where no inverse is, nothing is near.
            const Vec3d there = node_T_world * head;
            const Vec3d nearest = wish.box.empty() ? Vec3d(Vec3d::Zero())
                                                   : Vec3d(there.cwiseMax(wish.box.lower).cwiseMin(wish.box.upper));
            judged.wanted = judged.wanted || (world_T_node * nearest - head).norm() <= wish.distance;
        }
    }
    if (!judged.wanted) return judged;
    std::ranges::reverse(chain);
    if (wish.file.empty())
        judged.problem = "it names no file";
    else if (bearers.size() > 1)
        judged.problem = fmt::format("{} nodes share this core; give each one of its own", bearers.size());
    else if (!scene.get<Node>(bearer)->children.empty())
        judged.problem = "nodes are below it already; what the file holds would come among them";
    else if (chain.size() >= kMostChain)
        judged.problem = fmt::format("Inlines are nested deeper than {} levels", kMostChain);
    judged.order = {.node = bearer,
                    .path = std::string(wish.file),
                    .content = Preparation::Content{.core = core, .type = wish.type, .chain = std::move(chain)}};
    return judged;
}

}  // namespace tessera
