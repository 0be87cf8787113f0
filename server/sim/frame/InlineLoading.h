/// Which file of an Inline or a ProxyGroup is read next: by where heads are, one after the other.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/wall/View.h"
#include "server/sim/frame/InlineContents.h"
#include "server/sim/frame/Preparation.h"

namespace tessera {

/// Asks for files and says how that goes, in `state` and `problem`. One file is on its way at a time, so nothing that a
/// scene says can have more than one read; those that wait have their turns in the order of their ids.
///
/// A core is wanted at once, once `wanted` is set, or (near) while the head of any user that tiles are drawn for is
/// within `distance`: of a ProxyGroup's box, else of the node's origin; in the world, to the place that is nearest in
/// the node's own coordinates. Shown or not. Nothing is read for a node that hangs nowhere, that has nodes below it
/// already, that shares its core with others, or below kMostChain others. What is on its way in the scene and not here
/// (after a restart, in a copy) begins again.
///
/// Below a node of the scene's top below which kMostBrought have content, wherever that came from, no file is read: one
/// load is below one, and files that inline files, or definitions that multiply, are more than anybody meant. Those
/// that wait there say so, and are tried again when they are wanted again.
///
/// A frame looks at kPerFrame of those that wait, in turn, and costs nothing where nobody does. Not thread-safe.
class InlineLoading {
public:
    /// Of the edits that carry what is said; nobody waits for them.
    static constexpr std::uint64_t kTicket = ~std::uint64_t{1};
    static constexpr std::size_t kPerFrame = 256, kMostChain = 8, kMostBrought = 4096;

    /// Of a wall without tiles nobody is near anything.
    explicit InlineLoading(const Wall& wall);

    /// What is to be written. `view`: of the frame before. An order that comes of it, without a ticket, can be taken
    /// afterwards.
    [[nodiscard]] ChangeList advance(const Aspect& scene, const InlineContents& inlines, const View& view);
    [[nodiscard]] std::optional<Preparation> takeOrder() { return std::exchange(order_, std::nullopt); }
    /// Of the order that was taken: its content is there, or why it never will be.
    void ended(ObjectId core, const std::optional<std::string>& problem);

    [[nodiscard]] std::uint64_t work() const { return work_; }

private:
    struct Judged {
        bool wanted = false;
        std::string problem;  ///< why it cannot be; empty: it can
        ObjectId top;         ///< the node below the root that it hangs below, or is
        Preparation order;
    };
    [[nodiscard]] Judged judge(const Aspect& scene, const InlineContents& inlines, ObjectId core,
                               const std::vector<Vec3d>& heads) const;
    [[nodiscard]] std::vector<Vec3d> headsIn(const View& view) const;
    /// Whether one more is too many there.
    [[nodiscard]] bool isFull(const Aspect& scene, const InlineContents& inlines, ObjectId top);

    std::vector<std::pair<Screen, User>> lookers_;  ///< each user that tiles are drawn for, once a screen
    std::optional<Preparation> order_;
    ObjectId underWay_;  ///< the core whose file is being read; none: nothing is
    /// By the top node: the cores below it that have content, as of `counted_`, and those that were ordered since; some
    /// may have gone.
    std::map<ObjectId, std::set<ObjectId>> brought_;
    std::uint64_t counted_ = 0;               ///< InlineContents::moves
    std::size_t forgetAt_ = 64;               ///< of `brought_`: nodes that have gone
    std::map<ObjectId, std::string> failed_;  ///< to be said
    ObjectId last_;                           ///< looked at last
    std::uint64_t work_ = 0;
};

}  // namespace tessera
