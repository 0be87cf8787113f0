/// Imports files off the frame thread, a few at once.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/base/Guarded.h"
#include "common/base/LaneThreads.h"
#include "common/base/TimeSource.h"
#include "server/import/Importer.h"
#include "server/sim/desk/SceneFiles.h"
#include "server/sim/frame/Preparation.h"
#include "server/sim/reload/HeldFile.h"

namespace tessera {

/// Owns the lane of imports. Orders begin in the order in which they came; a file that takes long holds up no other but
/// where kAtOnce of them do, so what was ordered later may be there earlier. `onFinished` is called on threads of the
/// loader's, on several at once. Destruction cancels the imports under way, and waits for them. What a refused load
/// took of memory is given back.
class Loader {
public:
    /// Each may take the memory of `ImportOptions::maxMemoryBytes`.
    static constexpr std::size_t kAtOnce = 3;

    /// `files`: which may be read; told what those that are read name.
    Loader(ImportOptions options, std::shared_ptr<SceneFiles> files, std::function<void(Preparation)> onFinished,
           const MakeLane& lane = LaneThreads::make, const TimeSource& time = machineTime());
    ~Loader();

    /// False when too many orders wait already.
    bool order(Preparation order);

    struct UnderWay {
        std::uint64_t ticket = 0;
        std::string path;
        TimePoint since = {};
        std::shared_ptr<ImportWatch> watch;
    };
    /// Ordered, not cancelled, and not told of by `onFinished` yet; the oldest first. Any thread.
    [[nodiscard]] std::vector<UnderWay> underWay() const;
    /// It is refused with this reason, soon: the importer ends at once, and what is being built of it is thrown away.
    /// False: it is not under way. Any thread.
    bool cancel(std::uint64_t ticket, const Error& why);

private:
    void finish(Preparation made);
    void forget(const std::shared_ptr<ImportWatch>& watch);
    /// On a thread of its own, whose memory goes with it.
    void carryOutApart(Preparation order);
    void carryOut(Preparation& order) const;
    [[nodiscard]] Expected<ImportedScene> read(const Preparation& order) const;
    [[nodiscard]] Expected<ImportedScene> readContent(const Preparation& order) const;
    /// And say which files that took.
    [[nodiscard]] Expected<ImportedScene> readWatched(Preparation& order) const;
    [[nodiscard]] Expected<ImportedScene> readQuiet(Preparation& order) const;
    /// The file first.
    [[nodiscard]] std::shared_ptr<const WatchedFiles> filesOf(const Preparation& order,
                                                              std::vector<std::string> others) const;
    static void compare(Preparation& order, ChangeList list, std::optional<HeldFile> held);

    ImportOptions options_;
    std::shared_ptr<SceneFiles> files_;
    std::function<void(Preparation)> onFinished_;
    Guarded<std::vector<UnderWay>> underWay_;
    const TimeSource& time_;
    std::atomic<std::size_t> waiting_{0};
    std::unique_ptr<Lane> lane_;  ///< last
};

}  // namespace tessera
