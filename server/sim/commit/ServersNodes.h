/// Who may touch the nodes that the server makes so that something is seen: the server.
#pragma once

#include <set>
#include <unordered_map>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Knows all nodes at and below the tops of ServerNodes.h, their cores and the materials of those. They come and go as
/// they are needed: whatever refers to one would keep it from going, and would bring it into files. Not thread-safe.
class ServersNodes {
public:
    /// After each list applied to the scene, with that list; null: anything may have changed.
    void sceneChanged(const Aspect& scene, const ChangeList* list);

    /// Of an edit of a person or an application: kRefused where it makes something refer to one of them, puts something
    /// under one, changes one, or takes one away without the node that it belongs to. Costs a look-up per entry and
    /// reference, and after edits of the tree one of each of them; nothing where there are none.
    [[nodiscard]] Expected<void> check(const Aspect& scene, const ChangeList& list);

private:
    void gather(const Aspect& scene);
    [[nodiscard]] Error refusal(const Aspect& scene, ObjectId ours, const std::string& what,
                                std::string_view why) const;

    std::set<ObjectId> named_;                     ///< nodes that are called as tops are
    std::unordered_map<ObjectId, ObjectId> ours_;  ///< each object of theirs → its top
    bool stale_ = true;
};

}  // namespace tessera
