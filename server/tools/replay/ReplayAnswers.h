/// What tessera-replay prints.
#pragma once

#include <string>

#include "server/sim/recording/RecordingReplay.h"

namespace tessera {

/// One line: {"frame", "state_hash", "contacts": [{"objects", "faces", "point", "normal", "interest", "time"}]},
/// objects by path, in the order of the pipeline.
[[nodiscard]] std::string contactsLine(FrameNumber frame, const FrameResult& made, const Aspect& scene);

struct ReplaySummary {
    std::string file;
    const record::Opening& opening;
    unsigned threads = 1;
    const ReplayResult& result;
};

/// Some lines for a person.
[[nodiscard]] std::string summaryText(const ReplaySummary& summary);
/// One line: {"file", "recorded": {"program", "instruction_set", "threads"}, "threads", "frames", "frame_ms": {"mean",
/// "p50", "p99", "max"}, "result": "same" | "different" | "damaged", "end", "differing_frames", "first_difference":
/// {"frame", "what"}, "notes"}.
[[nodiscard]] std::string summaryJson(const ReplaySummary& summary);

}  // namespace tessera
