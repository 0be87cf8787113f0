/// Fields that the server alone writes: what it found out of an object, or has chosen.
#pragma once

#include <string_view>

#include "common/change/Value.h"

namespace tessera {

struct FieldOfServer {
    ObjectType type;
    FieldId field;
    std::string_view instead;  ///< what a person does who wants another value; empty: nothing
    bool anew = false;         ///< the server says it in each frame, so that nobody else's value stays
};

/// Null: anybody who edits may write it. What is new may come with any value: whoever finds out says it anew.
[[nodiscard]] const FieldOfServer* fieldOfServer(ObjectType type, FieldId field);

}  // namespace tessera
