/// A random show whose journal is kept, and what it was like after each record.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "server/sim/frame/Simulation.h"
#include "server/sim/journal/Journal.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/ReadableLog.h"
#include "tests/unit/TestFolder.h"
#include "tests/unit/journal/ModelDisk.h"
#include "tests/unit/recording/RandomShow.h"

namespace tessera::test {

/// How a scene stands.
struct Standing {
    StateHash stateHash;
    std::size_t undo = 0, redo = 0;
    bool operator==(const Standing&) const = default;
};
inline Standing standingOf(const Simulation& simulation) {
    return {simulation.scene().stateHash(), simulation.history().undoDepth(), simulation.history().redoDepth()};
}

/// Nothing is synced: no test cuts the power below it. `powerCut`: it was cut before.
inline Expected<Journal::Opened> openJournal(const std::string& folder, BlobStore& arrays, Log& log,
                                             JournalLimits limits = {}, std::vector<std::string> scenes = {},
                                             bool powerCut = false) {
    return Journal::open({.folder = folder,
                          .scenes = std::move(scenes),
                          .limits = limits,
                          .calls = std::make_shared<UnsyncedDisk>(powerCut)},
                         arrays, log, {});
}

/// Says as a person does that the journal shall go on with what is in the folder.
inline void goOnWith(const std::string& folder, std::uint64_t newestLog) {
    std::ofstream(folder + "/last", std::ios::trunc) << newestLog << "\n";
}

/// For a simulation that goes on from it.
inline Simulation::Left leftIn(JournalState& state) {
    return {.scene = std::move(state.scene),
            .sequence = state.sequence,
            .history = std::move(state.history),
            .display = std::move(state.display)};
}

inline void goOn(Simulation& simulation, Journal::Opened& opened) {
    if (opened.state.begun) simulation.goOnFrom(leftIn(opened.state));
    simulation.skipNumbers(opened.nextId, opened.behind);
}

/// Waits until all that was handed over is written. False: it took too long.
inline bool waitUntilWritten(const Journal& journal) {
    return eventually([&] { return journal.written() >= journal.handed(); });
}

/// The show's frames into a journal. By sequence, every state that was committed is in `standings`.
class KeptShow {
public:
    explicit KeptShow(Random& random) : show(random) {}
    void load(Journal& journal) {
        const Expected<CommittedFrame> loaded = show.load();
        ASSERT_TRUE(loaded) << loaded.error().message;
        journal.started(*loaded);
        note();
    }
    void frames(Journal& journal, std::uint64_t count) {
        for (const std::uint64_t end = next.value + count; next.value < end; next = next.next()) {
            const FrameResult result = show.frame(next);
            journal.frameDone(next, result, show.simulation().display());
            note();
        }
    }
    void note() { standings[show.simulation().sequence().value].push_back(standingOf(show.simulation())); }

    RandomShow show;
    FrameNumber next;
    /// (A frame may change the history and nothing else.)
    std::map<std::uint64_t, std::vector<Standing>> standings;
};

inline std::vector<std::string> filesIn(const std::string& folder) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().filename() != "lock" && entry.path().filename() != "last")
            names.push_back(entry.path().filename().string());
    std::ranges::sort(names);
    return names;
}

}  // namespace tessera::test
