/// Has one program of a person tried, by a process of its own: the server links no GL, and compiles nobody's text.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "common/base/ChildProgram.h"
#include "common/base/Clock.h"
#include "common/base/Error.h"
#include "common/base/FileHandle.h"
#include "common/cores/SurfaceParts.h"

namespace tessera {

struct TrialVerdict {
    std::int64_t verdict = SurfaceProgram::kUntried;  ///< kUntried: nobody could try it
    std::string problem;
    bool operator==(const TrialVerdict&) const = default;
};

/// While it lives, so does a child: it is killed and reaped at the latest when this goes. Not thread-safe.
class ProgramTrial {
public:
    /// `program`: the path of tessera-try-program; empty: beside the running one.
    [[nodiscard]] static Expected<ProgramTrial> start(const SurfaceProgram& what, const std::string& program,
                                                      TimePoint now);

    /// Nothing: it goes on. Never waits, but for as long as `patience`.
    [[nodiscard]] std::optional<TrialVerdict> poll(TimePoint now, Duration patience = {});

    /// Of the processor, which the child keeps to by itself; of the clock, where it gets none.
    static constexpr int kProcessorSeconds = 2, kSeconds = 20;

private:
    ProgramTrial(ChildProgram child, FileHandle output, TimePoint deadline)
        : child_(std::move(child)), output_(std::move(output)), deadline_(deadline) {}
    [[nodiscard]] TrialVerdict ended();

    ChildProgram child_;
    FileHandle output_;
    TimePoint deadline_;
    std::string said_;
};

}  // namespace tessera
