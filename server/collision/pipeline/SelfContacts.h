/// What runs into itself, of the parts that an interest of mode self asks about.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "server/collision/pipeline/ContactList.h"

namespace tessera {

/// Looked at again where a shape is another one or has been deformed: not where it moves. Not thread-safe.
class SelfContacts {
public:
    /// Once a step, after deformations are settled. `changed`: parts that have come, gone, or have another pose or
    /// shape. What the work was not enough for is asked again. Says whether anything was looked at.
    bool follow(const ObjectHandler& handler, std::span<const std::uint32_t> changed, std::size_t most,
                QueryWork& work);
    /// Parts that the work was not enough for.
    [[nodiscard]] std::span<const std::uint32_t> incomplete() const { return incomplete_; }
    /// What touches, for the list of a step: by part.
    [[nodiscard]] std::vector<Touching> contacts(const ObjectHandler& handler) const;

private:
    struct Known {
        std::uint32_t interest = 0;
        std::shared_ptr<const CollisionShape> shape;
        std::vector<FacePair> faces;  // the first of them
        std::uint64_t count = 0;
        bool stale = true;
    };
    void note(const ObjectHandler& handler, std::uint32_t part);

    std::map<std::uint32_t, Known> known_;  // by part
    std::vector<std::uint32_t> stale_, incomplete_;
    std::uint64_t generation_ = 0, interests_ = 0;
    bool anyInterest_ = false;
};

}  // namespace tessera
