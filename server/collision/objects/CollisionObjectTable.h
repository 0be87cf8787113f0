/// The visible CollisionObjects, and which nodes they name.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/cores/CollisionWords.h"
#include "common/scene/Aspect.h"
#include "server/collision/objects/IdTable.h"
#include "server/collision/pairwise/CollisionShape.h"

namespace tessera {

/// By number; numbers that have become free are given again.
class CollisionObjectTable {
public:
    struct Entry {
        ObjectId core, node;
        std::int64_t kind = CollisionWords::kRigid, division = CollisionWords::kWhole;
        std::int64_t layers = 1;
        ShapeChoice choice;
        std::vector<std::uint32_t> bodies;  ///< kept by whoever makes them
        std::uint64_t changed = 0;          ///< in which update its rules did
    };

    void clear();
    /// A core that came, went or has other rules; `visible`: some visible node bears it. Appends the nodes that may
    /// have another object, or one with other rules.
    void follow(const Aspect& aspect, ObjectId core, bool visible, std::uint64_t update, std::vector<ObjectId>& nodes);
    /// Numbers of what is gone may be given again.
    void recycle();

    [[nodiscard]] Entry& at(std::uint32_t number) { return entries_[number]; }
    [[nodiscard]] const Entry& at(std::uint32_t number) const { return entries_[number]; }
    [[nodiscard]] std::uint32_t find(ObjectId core) const { return numbers_.find(core); }
    /// The object that a node is: of several that name it the lowest counts. kNone.
    [[nodiscard]] std::uint32_t naming(ObjectId node) const {
        if (naming_.empty()) return IdTable::kNone;
        const auto named = naming_.find(node);
        return named == naming_.end() ? IdTable::kNone : numbers_.find(named->second.front());
    }

private:
    std::vector<Entry> entries_;
    std::vector<std::uint32_t> free_, gone_;
    IdTable numbers_;
    std::unordered_map<ObjectId, std::vector<ObjectId>> naming_;  // ascending
};

}  // namespace tessera
