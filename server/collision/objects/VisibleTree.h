/// The visible nodes of a scene, followed from list to list, and what collision needs to know of them.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/base/PagedRow.h"
#include "common/scene/Aspect.h"
#include "server/collision/objects/DocumentOrder.h"
#include "server/collision/objects/IdTable.h"
#include "server/collision/objects/Place.h"

namespace tessera {

/// A place for each visible node. Follows placements, cores and choices at a cost of what comes, goes and is carried
/// along; poses are kept up to date by whoever owns the tree.
class VisibleTree {
public:
    static constexpr std::uint32_t kNone = Place::kNone;

    /// A core that visible nodes bear.
    struct Bearers {
        ObjectId core;  ///< none: the number is free
        CoreKind kind = CoreKind::kOther;
        std::uint32_t first = kNone;  ///< one of the places; the others by `nextBearer`
        std::uint32_t count = 0;
    };

    /// What `follow` found. Places that are gone keep their numbers, and what they held, until `recycle`.
    struct Changes {
        std::vector<std::uint32_t> placed;   ///< new or elsewhere, with all below them
        std::vector<std::uint32_t> gone;     ///< each by itself
        std::vector<std::uint32_t> recored;  ///< stay, and bear another core
        std::vector<ObjectId> objects;       ///< CollisionObject cores that came, went or are borne elsewhere
        std::vector<ObjectId> shared;        ///< Transform cores that one place bears now, or no longer one alone
        bool interests = false;              ///< Interest cores came, went or are borne elsewhere
        bool environments = false;
    };

    /// Forgets everything and shows the scene from its root.
    void begin(const Aspect& aspect);
    /// Nodes that were placed, that bear another core, and Switch cores that chose anew, in a list that the aspect has
    /// applied.
    void follow(const Aspect& aspect, std::span<const Placement> placements, std::span<const ObjectId> recored,
                std::span<const ObjectId> switches);
    [[nodiscard]] Changes& changes() { return changes_; }
    /// Ends an update: the numbers of what is gone may be given again.
    void recycle();

    [[nodiscard]] const PagedRow<Place>& places() const { return places_; }
    [[nodiscard]] Place& at(std::uint32_t place) { return places_[place]; }
    [[nodiscard]] const Place& at(std::uint32_t place) const { return places_[place]; }
    /// kNone where the node is hidden, detached or none.
    [[nodiscard]] std::uint32_t find(ObjectId node) const { return placeOf_.find(node); }
    [[nodiscard]] const DocumentOrder& order() const { return order_; }
    [[nodiscard]] std::size_t size() const { return placeOf_.size(); }

    /// Cores of kinds that mean something, by number; kNone where no place bears it.
    [[nodiscard]] std::uint32_t bearersOf(ObjectId core) const { return bearersOf_.find(core); }
    [[nodiscard]] std::span<const Bearers> bearers() const { return bearers_; }
    [[nodiscard]] std::uint32_t nextBearer(std::uint32_t place) const { return links_[place].next; }
    /// Visits the places of a core, by its number, in document order.
    template <typename Visit>
    void forBearers(std::uint32_t number, const Visit& visit) const {
        const Bearers& all = bearers_[number];
        if (all.count == 1) {
            visit(all.first);
            return;
        }
        for (const std::uint32_t place : sortedBearers(number)) visit(place);
    }
    [[nodiscard]] std::vector<std::uint32_t> sortedBearers(std::uint32_t number) const;
    /// The first of them in document order.
    [[nodiscard]] std::uint32_t firstBearer(std::uint32_t number) const;
    [[nodiscard]] const std::set<ObjectId>& interests() const { return interests_; }
    [[nodiscard]] const std::set<ObjectId>& environments() const { return environments_; }

    /// Visits a place and those below it in document order, until visit(place) says that what is below one is not
    /// wanted (false).
    template <typename Visit>
    void walk(std::uint32_t top, const Visit& visit) const {
        const std::uint32_t end = DocumentOrder::close(top);
        for (std::uint32_t at = DocumentOrder::open(top); at != end; at = order_.next(at)) {
            if (!DocumentOrder::opens(at)) continue;
            if (!visit(DocumentOrder::placeOf(at))) {
                at = DocumentOrder::close(DocumentOrder::placeOf(at));
                if (at == end) return;
            }
        }
    }
    /// In document order, each once.
    void sort(std::vector<std::uint32_t>& places) const;
    /// Of these places those that are below no other of them, in document order.
    void topmost(std::vector<std::uint32_t>& places) const;

    /// So many more parts and topmost nodes of objects stand at a place.
    void count(std::uint32_t place, std::int32_t parts, std::int32_t objects);
    /// Whether `count` has to tell when the first object comes to stand at or below a place, or the last one goes.
    void watch(std::uint32_t place, bool yes) { links_[place].watched = yes; }
    [[nodiscard]] bool watchedChanged() const { return watchedChanged_; }
    void forgetWatched() { watchedChanged_ = false; }

private:
    struct Links {
        std::uint32_t previous = kNone, next = kNone;  // among the bearers of a core
        bool cutOut = false;                           // the top of what was taken from its parent
        bool watched = false;
        bool chooses = false;  // a Switch that does not show all children: the others are in hidden_
    };

    [[nodiscard]] std::uint32_t take();
    std::uint32_t show(const Aspect& aspect, ObjectId node, std::uint32_t parent, std::uint32_t after);
    void cutOut(std::uint32_t place);
    void putBack(std::uint32_t place, std::uint32_t parent, std::uint32_t after);
    void bear(const Aspect& aspect, std::uint32_t place, ObjectId core);
    void unbear(std::uint32_t place);
    void attach(const Aspect& aspect, std::uint32_t parent, std::span<const ObjectId> nodes);
    void choose(const Aspect& aspect, std::uint32_t place);
    void forgetHidden(const Aspect& aspect, std::uint32_t place);
    void drop(const Aspect& aspect);
    void countAbove(std::uint32_t place, std::int32_t parts, std::int32_t objects);

    PagedRow<Place> places_;
    std::vector<Links> links_;
    std::vector<std::uint32_t> free_;
    IdTable placeOf_;
    DocumentOrder order_;
    std::vector<Bearers> bearers_;
    std::vector<std::uint32_t> freeBearers_;
    IdTable bearersOf_;
    std::set<ObjectId> interests_, environments_;
    IdTable hidden_;  // children that a visible Switch does not show: its place
    std::vector<std::uint32_t> cutOuts_;
    Changes changes_;
    bool watchedChanged_ = false;
};

}  // namespace tessera
