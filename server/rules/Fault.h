/// What breaks a rule.
#pragma once

#include "common/base/Error.h"
#include "common/change/Value.h"

namespace tessera {

struct Fault {
    ObjectId object;
    ObjectType type;
    Error why;  ///< does not name the object: who found it knows what people call it
};
using Sound = tl::expected<void, Fault>;

}  // namespace tessera
