/// What is made beside the frames before it is an edit.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/math/Placing.h"
#include "common/scene/Clones.h"

namespace tessera {

class ImportWatch;
struct HeldFile;
struct FileChange;
struct WatchedFiles;

/// What a file holds, or a copy of much of a scene. It goes to the thread that makes it, and comes back with its lists.
struct Preparation {
    std::uint64_t ticket = 0;
    ObjectId node;         ///< below which the content of a file is put, or that is copied
    std::string path;      ///< of a file; with `content` as the core says it
    Placing placing = {};  ///< of a file
    /// By an application, which may not have every file read, while frames are shown: it is read and cut (LoadParts.h)
    /// with the lowest priority that there is, and so is everything after it.
    bool asked = true;
    /// What an Inline or a ProxyGroup holds: the list says too that it is there. It stands as the file has it.
    struct Content {
        ObjectId core;
        ObjectType type;
        std::vector<std::string> chain;  ///< files of the Inlines above it, outermost first
    };
    std::optional<Content> content = {};
    std::optional<CloneOptions> copy = {};  ///< none: a file is read
    std::uint64_t file = 0;  ///< that is taken in again, as its book calls it; 0: it is read for the first time
    std::shared_ptr<const HeldFile> former =
        {};  ///< of such: what it held; null: it is to be found in the scene by its names
    std::shared_ptr<const WatchedFiles> watched = {};  ///< of such: these must stay as they are while it is read

    std::shared_ptr<ImportWatch> watch = {};  ///< of a file that a Loader has been ordered to read

    std::optional<Error> refused = {};     ///< why there is nothing
    bool isShortage = false;               ///< of this machine, so that it may go another time
    std::vector<ChangeList> lists = {};    ///< cut for frames where `asked`, or of a copy; else one
    std::vector<Blob> arrays = {};         ///< that the lists of more than the first scene name
    ObjectId top = {};                     ///< the placeholder of the copy, or of the node that the file became
    std::uint64_t objects = 0;             ///< that all lists create
    std::uint64_t bytes = 0;               ///< of memory that the lists of a copy take; arrays are the scene's
    std::uint64_t triangles = 0;           ///< of a file, as drawn
    std::vector<std::string> notes = {};   ///< of the importer, for a person
    std::vector<ObjectId> exposures = {};  ///< ImportedScene::exposures, of a file
    std::shared_ptr<const WatchedFiles> files = {};  ///< that it was read from, or that were looked for
    std::shared_ptr<HeldFile> held =
        {};  ///< of a file that is read for the first time; null: it cannot be taken in again
    std::shared_ptr<FileChange> change = {};  ///< of one that is taken in again
};

}  // namespace tessera
