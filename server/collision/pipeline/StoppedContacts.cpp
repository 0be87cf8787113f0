#include "server/collision/pipeline/StoppedContacts.h"

#include <algorithm>
#include <utility>

namespace tessera {

std::vector<Touching> StoppedContacts::settle(const ObjectHandler& handler) {
    std::vector<Touching> told;
    std::vector<Kept> kept;
    const auto keep = [&](const Touching& touching) {
        kept.push_back(
            {touching, handler.parts()[touching.partA].poseVersion, handler.parts()[touching.partB].poseVersion});
        told.push_back(touching);
    };
    std::vector<std::pair<ObjectId, ObjectId>> pushedAgain;
    for (const Touching& touching : fresh_) {
        pushedAgain.emplace_back(touching.nodeA, touching.nodeB);
        keep(touching);
    }
    std::ranges::sort(pushedAgain);
    fresh_.clear();
    for (Kept& before : kept_) {
        Touching& touching = before.touching;
        if (std::ranges::binary_search(pushedAgain, std::pair(touching.nodeA, touching.nodeB))) continue;
        const std::uint32_t a = handler.partOf(touching.nodeA), b = handler.partOf(touching.nodeB);
        if (a == kNobody || b == kNobody || handler.parts()[a].poseVersion != before.versionA ||
            handler.parts()[b].poseVersion != before.versionB ||
            handler.relation(std::min(a, b), std::max(a, b)).response == InterestWords::kReport)
            continue;
        touching.partA = a;
        touching.partB = b;
        keep(touching);
    }
    kept_ = std::move(kept);
    return told;
}

}  // namespace tessera
