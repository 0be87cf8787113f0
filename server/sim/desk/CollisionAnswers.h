/// What a frame's collision step found, as applications and render hosts are told of it.
#pragma once

#include "common/codec/FrameCodec.h"
#include "common/request/CollisionRequests.h"
#include "server/collision/pipeline/StepResult.h"

namespace tessera {

/// `begun`: pairs of objects that came to touch, over the run.
[[nodiscard]] answer::Contacts contactsOf(const StepResult& step, FrameNumber frame, std::uint64_t begun);

/// In the order of the step, at most `most` events. Where there are more, pairs that go on touching are left out first:
/// who follows what begins and ends keeps a right picture for longer. `leftOut` counts what the step itself left out,
/// of events or distances, too.
[[nodiscard]] answer::PairEvents eventsOf(const StepResult& step, FrameNumber frame, bool stays, std::size_t most);
[[nodiscard]] answer::Distances distancesOf(const StepResult& step, FrameNumber frame, std::size_t most);
[[nodiscard]] QuestionValue valueOf(const Question& question);

/// For the hosts that draw.
[[nodiscard]] FrameCollision numbersOf(const StepResult& step);

}  // namespace tessera
