/// Which files may be read, and for whom.
#pragma once

#include <deque>
#include <set>
#include <string>
#include <vector>

#include "common/base/Channel.h"
#include "common/base/Error.h"
#include "server/import/AssetFolders.h"
#include "server/import/Importer.h"
#include "server/sim/desk/FolderListing.h"

namespace tessera {

/// An application has files read that lie below --allow, and assets. The scenes of the command line are trusted
/// further, by whoever started the server: what they name (Inlines, ProxyGroups, Movies), in their own folder or below,
/// is read too, and what files read in this way name in theirs. The same name said by anybody leads to the same file,
/// and no other name does: the folder itself is open to nobody. Of a scene in the root folder nothing is read beside
/// it.
///
/// A wall that goes on from its journal imports no scene: its files are read again once somebody asks for what they may
/// have named. Any thread, several at once; may take as long as files take to be read.
class SceneFiles {
public:
    /// `scenes`: as --scene says. `goesOn`: from a journal.
    SceneFiles(ImportOptions options, std::vector<std::string> allowed, std::vector<std::string> scenes = {},
               bool goesOn = false);

    /// What an application asks for itself: see `readableFile`.
    [[nodiscard]] Expected<std::string> ofApplication(const std::string& path) const {
        return readableFile(path, allowed_);
    }
    /// What an application may look through: see `listFolder`.
    [[nodiscard]] Expected<answer::FolderPage> list(const FolderWish& wish) const { return listFolder(wish, allowed_); }
    /// What an Inline, a ProxyGroup or a Movie of the running scene names: a whole path, without any link; or why it
    /// may not be read.
    [[nodiscard]] Expected<std::string> ofScene(const std::string& name);
    /// Of what has been read: of a scene of the command line, or of a file that `ofScene` gave.
    void add(const std::vector<std::string>& named);

    /// Of those that are read again.
    static constexpr std::size_t kMostRead = 256;

private:
    struct State {
        std::set<std::string> named;
        std::deque<std::string> unread;  ///< scenes that may name more; of a wall that goes on alone
        std::size_t read = 0;
    };
    [[nodiscard]] bool isNamed(State& state, const std::string& name) const;
    void note(State& state, const std::vector<std::string>& named) const;

    ImportOptions options_;
    ReadableFolders allowed_, withScenes_;
    bool goesOn_;
    Channel<State> state_{1};  ///< whoever has it works with it, and puts it back
};

}  // namespace tessera
