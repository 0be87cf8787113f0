#include "server/collision/query/TimeOfImpact.h"

#include "server/collision/query/RigidImpactSearch.h"

namespace tessera {

Impact timeOfImpact(const TriangleTree& a, const BodyMotion& motionA, const TriangleTree& b, const BodyMotion& motionB,
                    QueryWork& work, const ImpactOptions& options) {
    if (a.storage().empty() || b.storage().empty()) return {};
    const TreeImpactBody bodyA(a, motionA), bodyB(b, motionB);
    if (!bodyA.way.valid() || !bodyB.way.valid() || !Thickness(options).valid()) return {.t = 0, .complete = false};
    return RigidImpactSearch(bodyA, bodyB, options, work).run();
}

}  // namespace tessera
