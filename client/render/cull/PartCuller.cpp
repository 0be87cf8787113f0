#include "client/render/cull/PartCuller.h"

#include "client/render/cull/CoherentCuller.h"
#include "client/render/cull/TwoPhaseCuller.h"
#include "client/render/cull/WaitingCuller.h"

namespace tessera {

std::unique_ptr<PartCuller> makePartCuller(CullerKind kind) {
    switch (kind) {
        case CullerKind::kQueriesWait:
            return std::make_unique<WaitingCuller>();
        case CullerKind::kQueries:
            return std::make_unique<CoherentCuller>();
        case CullerKind::kTwoPhase:
            return std::make_unique<TwoPhaseCuller>();
        case CullerKind::kNone:
        case CullerKind::kFrustum:
        case CullerKind::kMasked:
        case CullerKind::kAuto:
            break;
    }
    return nullptr;
}

}  // namespace tessera
