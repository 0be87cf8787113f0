#include "client/render/PartCuller.h"

#include "client/render/CoherentCuller.h"
#include "client/render/TwoPhaseCuller.h"
#include "client/render/WaitingCuller.h"

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
