#include "server/collision/pipeline/ContactMemory.h"

namespace tessera {

const PairState& ContactMemory::state(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                                      QueryWork& work, std::uint64_t& queries) {
    const Part& a = handler.parts()[partA];
    const Part& b = handler.parts()[partB];
    PairState& known = pairs_[(std::uint64_t{partA} << 32) | partB];
    known.usedInStep = step_;
    if (known.versionA == a.poseVersion && known.versionB == b.poseVersion) return known;
    ++queries;
    const Affine3d a_T_b = a.world.inverse() * b.world;
    known.faces = allTouching(*a.shape, *b.shape, a_T_b, work);
    known.versionA = known.faces.complete ? a.poseVersion : 0;
    known.versionB = known.faces.complete ? b.poseVersion : 0;
    return known;
}

void ContactMemory::endStep() {
    std::erase_if(pairs_, [&](const auto& entry) { return entry.second.usedInStep != step_; });
    ++step_;
}

}  // namespace tessera
