#include "common/field/Field.h"

namespace tessera {

std::string_view nameOf(Unit unit) {
    static constexpr std::string_view kNames[] = {"",
                                                  "world units",
                                                  "s",
                                                  "frames",
                                                  "radians",
                                                  "pixels",
                                                  "world units per s",
                                                  "world units per s²",
                                                  "radians per s",
                                                  "world units per metre"};
    return kNames[static_cast<std::size_t>(unit)];
}

}  // namespace tessera
