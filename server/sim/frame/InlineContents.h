/// What Inlines and ProxyGroups hold, and what of it has to go.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/cores/LoadWords.h"
#include "common/math/Box.h"
#include "common/scene/Aspect.h"
#include "server/sim/commit/EditHistory.h"

namespace tessera {

/// An Inline or a ProxyGroup, read alike.
struct LoadWish {
    ObjectType type;
    std::string_view file;
    std::int64_t load = LoadWords::kAtOnce;
    double distance = 0;  ///< of kNear
    bool wanted = false;
    std::int64_t state = LoadWords::kWaiting;
    Box box;                                ///< of a ProxyGroup, in the node's coordinates; else empty
    bool promises = false;                  ///< it is a ProxyGroup: something is shown of it meanwhile
    std::int64_t nodes = 0, triangles = 0;  ///< of one: what the file holds; 0: not known
};
/// Nothing of other objects. What it says holds as long as the object.
[[nodiscard]] std::optional<LoadWish> loadWishOf(const Object& core);
/// Writes `state` and `problem`, the latter cut to what a text of the scene may hold.
void setLoadState(ChangeListBuilder& edits, ObjectId core, ObjectType type, std::int64_t state,
                  std::string_view problem = {});

/// Follows the Inlines and ProxyGroups of a scene and the nodes that bear them, through its lists: a list costs a
/// look-up per entry. Not thread-safe.
///
/// All that hangs below such a node, once its file is there, is its content: it goes as a whole when another file is
/// named, or when `wanted` is taken back and nothing else wants it.
class InlineContents {
public:
    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list);

    /// Cores whose state is waiting or loading, ascending.
    [[nodiscard]] const std::set<ObjectId>& pending() const { return pending_; }
    /// Cores whose content is there, ascending.
    [[nodiscard]] const std::set<ObjectId>& there() const { return there_; }
    /// Another number whenever content may have come below other nodes than those that it was loaded for: by a move,
    /// with a file, with another scene.
    [[nodiscard]] std::uint64_t moves() const { return moves_; }
    /// The nodes that bear a core, ascending; of others none.
    [[nodiscard]] const std::set<ObjectId>& bearersOf(ObjectId core) const;
    /// Looked up and compared so far: what tests of cost count.
    [[nodiscard]] std::uint64_t work() const { return work_; }

    /// What a list of an application may not say of cores that are there (their state), or, of the server's own, what
    /// it may not say any more: that content is there which nobody waits for. `own`: what the load makes of which the
    /// list is a part; no part of it is placed where nobody waits.
    [[nodiscard]] Expected<void> check(const Aspect& scene, const ChangeList& list, bool ofServer,
                                       const IdRange& own = {}) const;

    /// What a person's list changes of what a core wants.
    struct Change {
        ObjectId core;
        bool file = false;       ///< it names another one
        bool takenBack = false;  ///< `wanted` was set and is not any more
    };
    /// `scene`: as it is before the list.
    [[nodiscard]] std::vector<Change> changesBy(const Aspect& scene, const ChangeList& list) const;
    /// What follows from it, once the list has been applied: states, of a core the way its content goes. One list each,
    /// to be applied one after the other. What is refused stays.
    struct Consequence {
        ObjectId core;
        ObjectType type;
        ChangeList list;
    };
    [[nodiscard]] std::vector<Consequence> following(const Aspect& scene, const std::vector<Change>& changes) const;
    /// The way content goes that stands below nodes which the list destroys, and which the list does not know: it has
    /// come since.
    [[nodiscard]] std::vector<Consequence> inTheWayOf(const Aspect& scene, const ChangeList& list) const;

private:
    [[nodiscard]] Expected<void> checkPlaces(const Aspect& scene, const ChangeList& part, const IdRange& own) const;
    void noteNode(const Aspect& scene, ObjectId node);
    void noteCore(const Aspect& scene, ObjectId core);

    std::unordered_map<ObjectId, std::set<ObjectId>> bearers_;  ///< of cores that are there
    std::unordered_map<ObjectId, ObjectId> coreOf_;             ///< of the nodes that bear them
    std::set<ObjectId> pending_, there_;
    std::uint64_t work_ = 0, moves_ = 0;
};

}  // namespace tessera
