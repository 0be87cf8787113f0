/// What an application keeps at a node for everybody to see.
#pragma once

#include <string>

#include "common/base/Blob.h"
#include "common/field/Field.h"

namespace tessera {

/// Belongs to the node above the one that bears it; replicated, saved, undone like everything in a scene, and drawn by
/// nobody. DeclaredTable (common/scene) reads and writes it. Of what stays with the application alone SideTable keeps
/// account.
struct ApplicationData {
    static constexpr ObjectType kType{37};
    std::string key;  ///< what it is, e.g. "org.example.score"; those of one node have different ones
    Blob data;        ///< as the application has it
};
template <>
inline constexpr auto kSaid<ApplicationData> = []<typename T>(Describing<T>) {
    return describe("ApplicationData", field<&T::key>(1, "key").affects(Effect::kName),
                    field<&T::data>(2, "data").affects(Effect::kNone));
};

}  // namespace tessera
