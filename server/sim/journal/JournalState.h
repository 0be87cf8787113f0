/// What a journal's records lead to.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/sim/journal/JournalFormat.h"

namespace tessera {

/// All that a server needs to go on. Records are taken in their order; one that does not fit is refused, and nothing
/// may be taken after it. Not thread-safe.
class JournalState {
public:
    /// The first of a file, or of the first of several.
    [[nodiscard]] Expected<void> take(journal::Opening opening);
    [[nodiscard]] Expected<void> take(journal::Frame frame);
    [[nodiscard]] Expected<void> take(const journal::Frames& frames);
    [[nodiscard]] Expected<void> take(const journal::Numbers& numbers);
    [[nodiscard]] Expected<void> take(journal::View view);
    [[nodiscard]] Expected<void> take(const journal::Raised& raised);
    [[nodiscard]] Expected<void> take(journal::Step step);
    [[nodiscard]] Expected<void> take(journal::State state);
    [[nodiscard]] Expected<void> take(JournalRecord record);

    /// As the records of a snapshot but for its opening, the arrays that they name left out. Calls `write` with each;
    /// false ends it. What is handed over is let go of: nothing is in memory as part of the state and as its record.
    void forEachRecord(const std::function<bool(JournalRecord)>& write) &&;

    bool begun = false;  ///< there has been a scene, though it may be an empty one
    Aspect scene;
    Sequence sequence;  ///< of the scene
    /// What the last server may have given and sent beyond that; nothing: nobody knows.
    std::optional<journal::Numbers> numbers;
    FrameNumber nextFrame;  ///< none before it comes again
    EditHistory history;
    std::vector<ObjectId> display;
    std::optional<ViewState> view;
    Epoch epoch;                      ///< the highest
    std::vector<std::string> scenes;  ///< what --scene said when the journal began; then how they stand
    /// Of these the files, and how they stand ("--up z"; empty: nobody said).
    [[nodiscard]] std::vector<std::string> sceneFiles() const;
    [[nodiscard]] std::string placing() const;
    /// From the last opening.
    std::uint64_t number = 0;
    std::string program;
    std::uint64_t schema = 0;
    std::uint32_t format = 0;
    journal::LogBefore before;
};

}  // namespace tessera
