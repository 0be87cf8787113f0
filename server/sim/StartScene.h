/// The scene files of the command line: they are the scene before the first frame.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Log.h"
#include "server/sim/desk/Loader.h"
#include "server/sim/desk/ReloadRequests.h"

namespace tessera {

/// Orders the files, each once the one before it is there, and collects what comes of them; then in the same way the
/// files of the Inlines in them that are wanted at once, so that the first frame shows the same whatever takes how
/// long. Beyond kMostInlines the others come while frames are shown.
class StartScene {
public:
    static constexpr std::size_t kMostInlines = 256;

    /// `placing`: of each of the files.
    explicit StartScene(std::vector<std::string> paths, Placing placing = {});
    ~StartScene();

    /// The first file; the others follow. Orders carry this ticket.
    [[nodiscard]] Expected<void> order(Loader& loader, std::uint64_t ticket) const;
    /// The lists of all files once the last one has come; nothing before. Fails as a file fails; what an Inline cannot
    /// have is in its state.
    [[nodiscard]] Expected<std::optional<std::vector<ChangeList>>> take(Preparation made, Loader& loader, Log& log);
    [[nodiscard]] bool empty() const { return paths_.empty(); }
    /// Where the lists' ids will begin, if others have been taken before: lists of Inlines' states name them.
    void idsFrom(std::uint64_t first) { firstId_ = first; }
    /// The files of the lists, with the ids that these have been given.
    [[nodiscard]] std::vector<FileInScene> takeFiles() { return std::exchange(files_, {}); }

private:
    struct Draft;
    /// One more, with the file that it has come from.
    void add(Preparation made);
    /// Once all files are there: of what is said of the surroundings what a file's author wrote holds, before what a
    /// model's lights ask for; then the first.
    void settleSurroundings(Log& log);
    [[nodiscard]] std::optional<std::vector<ChangeList>> goOn(Loader& loader, std::uint64_t ticket);

    std::vector<std::string> paths_;
    Placing placing_;
    std::vector<ChangeList> lists_;
    std::vector<FileInScene> files_;
    /// A file that brings an Environment.
    struct Surroundings {
        std::string path;
        std::vector<ObjectId> exposures;  ///< the node and core of one that nobody wrote; else none
    };
    std::vector<Surroundings> surroundings_;
    std::uint64_t objects_ = 0;     ///< of all lists so far
    std::unique_ptr<Draft> draft_;  ///< the scene so far, once all files are there and one has Inlines
    std::size_t inlines_ = 0;
    std::uint64_t firstId_ = 0;
};

}  // namespace tessera
