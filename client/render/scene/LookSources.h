/// The materials in use, each by itself, and what each is made of: a change finds the looks that it makes old.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <unordered_map>

#include "client/render/DrawMaterial.h"

namespace tessera {

class LookSources {
public:
    /// To be released as often.
    [[nodiscard]] std::shared_ptr<const LookSource> acquire(const Aspect& aspect, ObjectId material);
    void release(ObjectId material);
    /// An object has new values. Costs the looks that are made of it.
    void changed(const Aspect& aspect, ObjectId id);
    void clear();

private:
    struct Use {
        std::shared_ptr<LookSource> source;
        std::set<ObjectId> parts;  ///< images, layers and theirs, program, uniforms and theirs
        std::uint32_t users = 0;
    };
    void look(const Aspect& aspect, Use& use);
    void setParts(Use& use, std::set<ObjectId> parts);

    std::unordered_map<ObjectId, Use> uses_;         ///< by material
    std::map<ObjectId, std::set<ObjectId>> madeOf_;  ///< materials by their parts
};

}  // namespace tessera
