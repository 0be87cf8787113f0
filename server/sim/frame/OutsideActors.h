/// Who acts on the scene by what is outside of it: views, clocks, files, processes.
#pragma once

#include "server/movies/Movies.h"
#include "server/programs/ProgramNotices.h"
#include "server/programs/ProgramTrials.h"
#include "server/sim/frame/InlineLoading.h"
#include "server/sim/view/ExposureMeter.h"
#include "server/sim/view/FrameBudget.h"
#include "server/sim/view/HandleSizes.h"
#include "server/sim/view/LevelChoice.h"

namespace tessera {

/// Each by itself, for those who ask it something; frames know them as rows (Actors.h). What they say reaches the step
/// as edits, so a replay has none of them. Frame thread only.
struct OutsideActors {
    /// `drags` outlives it.
    OutsideActors(const Wall& wall, ManipulatorDrags& drags, Movies::Opener open, bool withNotices = true,
                  const ExposureWish& exposureWish = {}, const TimeSource& time = machineTime(),
                  Duration childPatience = {})
        : inlines(wall),
          programs({}, time, childPatience),
          notices(wall),
          saysNotices(withNotices),
          films(std::move(open), {}, childPatience),
          handleSizes(wall, drags),
          levels(wall),
          budget(wall.budgetMs),
          exposure(exposureWish) {}

    InlineLoading inlines;
    ProgramTrials programs;
    std::vector<ChangeList> earlyVerdicts = {};  ///< of programs that the scene brings, for the first frame
    FrameNumber frame = {};                      ///< being made
    ProgramNotices notices;
    bool saysNotices;  ///< walls say what is wrong with programs
    Movies films;
    HandleSizes handleSizes;
    LevelChoice levels;
    FrameBudget budget;
    ExposureMeter exposure;
};

}  // namespace tessera
