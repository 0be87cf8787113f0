/// What a frame is given where one thing is wished.
#pragma once

#include <vector>

#include "server/sim/frame/Simulation.h"

namespace tessera::test {

[[nodiscard]] inline std::vector<Edit> one(Edit edit) {
    std::vector<Edit> edits;
    edits.push_back(std::move(edit));
    return edits;
}
[[nodiscard]] inline std::vector<Edit> one(ChangeList list, std::uint64_t ticket = 1) {
    return one(Edit{.ticket = ticket, .list = std::move(list)});
}
[[nodiscard]] inline std::vector<Edit> one(ChangeList list, Gesture gesture) {
    return one(Edit{.list = std::move(list), .gesture = gesture});
}
[[nodiscard]] inline std::vector<Edit> one(Edit::Kind kind, ChangeList list = {}) {
    return one(Edit{.list = std::move(list), .kind = kind});
}

}  // namespace tessera::test
