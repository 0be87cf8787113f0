/// Files of scenes and models to change lists.
///
/// Whatever reads a foreign file runs in a child process (`tessera-import`) that has no network, may read its file's
/// own folder only, and has bounds on memory, processor time and wall time. What comes back is checked before it
/// becomes a list, so a hostile file can cost its bounds and an error message, and nothing else.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/math/Placing.h"
#include "common/scenefile/SceneFile.h"
#include "server/import/ImportWatch.h"

namespace tessera {

struct ImportOptions {
    /// Where `asset://NAME` is looked for, first match wins.
    std::vector<std::string> assetFolders;
    /// Import even where the system can't confine the child (no Landlock or no seccomp). Limits and deadline remain.
    bool allowUnconfined = false;
    /// Geometry as the file has it, for whoever counts triangles: polygons become fans from their first corner
    /// (otherwise they are divided to look right), triangles keep the file's order, and coordinates in text (OBJ, OFF,
    /// PLY, STL) become the nearest floats. Of these formats nothing but geometry is read then.
    bool verbatim = false;
    /// For whoever computes with a file: what is cut off, or has faces or points that cannot be shown, is refused
    /// (kBadInput) in the words of the note that a wall gets.
    bool whole = false;
    /// Of USD's files: prims that show a variant of a set whatever the file says, "/Chair:color=red". A prim, a set or
    /// a variant that is not there is refused (kNotFound), with those that are. So are those of `placing`.
    std::vector<std::string> variants;
    /// The path leads to the file without any link, as somebody has found who may decide: what has become a link since
    /// is refused.
    bool resolved = false;
    /// Models get a Transform of their own, at the node that is named after the file, which places them and puts +Y up;
    /// what was guessed is a note. Scenes get such a node where the placing says anything. Transforms in the file stay
    /// as they are. None: what files hold stands as they have it.
    std::optional<Placing> placing;
    /// False: the files' cameras are there, and none is enabled. So are those of files whose `placing` is in metres.
    bool camerasEnabled = true;
    /// False: lights of models set no exposure, however strong they are, as the model is a part of something.
    bool exposes = true;
    /// With `placing`: scenes of several top nodes get such a node too, so that what is loaded is one thing that can be
    /// moved and removed.
    bool gathers = false;
    /// Empty: "tessera-import" beside the running program. The programs of other formats lie beside it.
    std::string importerProgram;

    /// Told how far it is; a cancelled import ends within a quarter of a second, as far as the child is concerned.
    /// Null: nobody looks.
    std::shared_ptr<ImportWatch> watch = {};

    std::size_t maxFileBytes = 0x7fffffff;
    // Of one child. A scene of Tessera's own gets more by its file's bytes: whatever a live scene holds comes back from
    // a file.
    std::size_t maxResultBytes = std::size_t{1} << 30;  ///< what it may hand over
    std::size_t maxMemoryBytes = std::size_t{2} << 30;  ///< address space
    /// And kCpuTimePerMebibyte for each MiB of the files that it reads, but no more than mostCpuTime. Ten times what
    /// the slowest of 1,346 real models takes. That is 0.9 s for few bytes (a surface that is divided), and 0.2 s for
    /// a MiB of large ones.
    std::chrono::seconds maxCpuTime{10};
    static constexpr std::chrono::seconds kCpuTimePerMebibyte{2};
    std::chrono::seconds mostCpuTime{60};  ///< and one more for each 4 MiB of the file
    /// Wall time, and four seconds more for each 4 MiB: live loads have the lowest priority, and machines are busy.
    std::chrono::milliseconds deadline{240'000};
    std::size_t maxNodes =
        SceneLimits().maxObjects;  ///< of models and of what authors wrote, in the whole import, instances counted
    std::size_t maxDepth = SceneLimits().maxDepth - 1;  ///< nodes below `parent`; the scene counts its root too
    std::size_t maxImportDepth = 8;                     ///< scene files that import scene files
};

struct ImportedScene {
    /// Creates everything and places it under the parent. New objects have placeholder ids, from kFirstPlaceholder up,
    /// in creation order. Blobs are resident.
    ChangeList list;
    /// The node placed under the parent. A model file becomes one node named after the file; the top-level nodes of a
    /// .tsct or .tsc are placed directly below the parent, and this is the first of them.
    ObjectId top;
    std::vector<ObjectId> tops;
    ObjectId place;  ///< the Transform of ImportOptions::placing, of the last file; none: there is none
    std::uint64_t nodes = 0;
    std::uint64_t cores = 0;            ///< all objects that are not nodes
    std::uint64_t geometries = 0;       ///< Geometry cores
    std::uint64_t triangles = 0;        ///< as drawn: every node's
    std::uint64_t trianglesStored = 0;  ///< every Geometry core's, once
    bool hasCamera = false;             ///< an enabled one
    /// The nodes and cores of Environments that nobody wrote: lights of models, as strong as real ones, ask for them.
    std::vector<ObjectId> exposures;
    /// What was left away or changed, for a person to read: textures made smaller, skins shown at rest, ….
    std::vector<std::string> notes;
    /// Of the notes those that say what is wrong in a scene's text, with its place: pictures that are not there or
    /// cannot be read. What names them is drawn without. Whoever shows a scene goes on; whoever checks or keeps it may
    /// not.
    std::vector<std::string> faults;
    /// Of the notes those about numbers of a scene's materials that are out of their bounds, with their places: the
    /// nearest good ones are taken. Whoever shows or keeps a scene goes on; whoever checks it may not.
    std::vector<std::string> mended;
    /// Files that Inlines, ProxyGroups and Movies of it name in the folder of the file that names them, or below: whole
    /// paths, whether they are there or not. Not assets, and nothing beside a file in the root folder.
    std::vector<std::string> named;
    /// Files that it was read from, and that were looked for: whole paths, no more than kMostFiles. Who takes it in
    /// again watches them.
    static constexpr std::size_t kMostFiles = 4096;
    std::vector<std::string> files;
    /// What a newer version saved in the file and this one does not know; ids as in the list. Of one file alone.
    LaterParts later;
};

/// Reads .tsct, .tsc, .gltf, .glb and what assimp reads (.obj, .ply, .stl, …). Blocks until done; call from any thread.
/// Errors name the file: kNotFound (no such file or asset), kBadInput (malformed, or the reader died of it), kLimit,
/// kUnsupported (no reader for it, or the child can't be confined here).
[[nodiscard]] Expected<ImportedScene> importScene(const std::string& path, ObjectId parent,
                                                  const ImportOptions& options);

/// Several files into one list. A file named by several of them is read once.
[[nodiscard]] Expected<ImportedScene> importScenes(std::span<const std::string> paths, ObjectId parent,
                                                   const ImportOptions& options);

}  // namespace tessera
