/// Files that the scene has come from, and that are taken in again when they have changed.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/sim/desk/OpenEdits.h"
#include "server/sim/reload/FileChange.h"
#include "server/sim/reload/FileWatch.h"
#include "server/sim/reload/ReloadPlan.h"

namespace tessera {

/// A file that is in the scene, and how it was read.
struct FileInScene {
    std::string path;  ///< as it was asked for
    ObjectId node;     ///< below which it stands
    Placing placing = {};
    bool asked = true;  ///< by an application, which may not have every file read
    std::optional<Preparation::Content> content = {};
    std::shared_ptr<const HeldFile> held = {};
    std::shared_ptr<const WatchedFiles> files = {};

    /// Nothing where it cannot be taken in again. Its objects have no ids yet.
    [[nodiscard]] static std::optional<FileInScene> of(const Preparation& made);
};

/// The book of the files that have been loaded. One is read beside the frames, compared with what it held before
/// (FileChange), planned beside the frames with the scene as it is then (ReloadPlan), and goes into frames as loads do.
/// Nobody's step: undo takes back what people do; the old file leads back from a new one. Frame thread only.
///
/// What the files held is kept while the book has room: kMostFiles, kMostBytes. The ones that were read longest ago go
/// first.
class ReloadRequests {
public:
    static constexpr std::size_t kMostFiles = 1024, kMostBytes = std::size_t{256} << 20, kMostWaiting = 64;

    ReloadRequests(const DeskSurroundings& around, OpenEdits& edits);

    void remember(FileInScene file);
    /// Those that were in the scene before this server began: they are read, and what is found of them by its names is
    /// what they held. What they change from then on is taken in. `begunWith`: how the scene was placed then, as
    /// options.
    void findAgain(const std::vector<std::string>& paths, const Placing& placing, const std::string& begunWith);
    /// Nothing: no file of that name is in the scene (below `parent`, where one is said). `otherwise`: it was also said
    /// how it is to stand, which is of no use.
    [[nodiscard]] std::optional<ServerActions> ask(const Asker& asker, const std::string& path, ObjectId parent,
                                                   bool otherwise);
    [[nodiscard]] ServerActions read(Preparation made, TimePoint now);

private:
    struct Known {
        FileInScene file;
        bool busy = false, again = false;
        bool isFound = true;  ///< false: it was in the scene before this server began, and has not been read since
        std::vector<Asker> waiting, askers;  ///< for the next time, and for this one
        bool otherwise = false;
        int tries = 0;
        std::string said;  ///< what was wrong with it at last; empty: nothing
        // While it is taken in.
        std::shared_ptr<FileChange> change;
        std::shared_ptr<const WatchedFiles> files;
        answer::Loaded told = {};
    };
    using Files = std::map<std::uint64_t, Known>;

    [[nodiscard]] ServerActions changed(std::uint64_t number, FileWatch::News news);
    void findAgain(const std::string& path, const Placing& placing);
    [[nodiscard]] bool stands(const FileInScene& file) const;
    [[nodiscard]] ServerActions begin(std::uint64_t number);
    void found(std::uint64_t number, const std::shared_ptr<HeldFile>& held, std::size_t objects);
    [[nodiscard]] ServerActions plan(std::uint64_t number, TimePoint now);
    [[nodiscard]] ServerActions planned(std::uint64_t number, Expected<ReloadPlan> plan, TimePoint now);
    [[nodiscard]] ServerActions committed(std::uint64_t number, const std::shared_ptr<ReloadPlan>& plan,
                                          const std::optional<Error>& refused, TimePoint now);
    [[nodiscard]] ServerActions end(std::uint64_t number, const std::optional<Error>& refused, bool isShortage = false);
    void count(Known& known, const ReloadPlan& plan) const;
    void say(const std::string& words, bool isWrong = false) const;
    void forgetOldest();
    Files::iterator forget(Files::iterator known);

    const DeskSurroundings& around_;
    OpenEdits& edits_;
    Files files_;  ///< in the order in which they were loaded
    std::uint64_t next_ = 1;
    std::size_t bytes_ = 0;
    std::unique_ptr<FileWatch> watch_;  ///< last: its thread tells; null: nobody wants to know what changes on disk
};

}  // namespace tessera
