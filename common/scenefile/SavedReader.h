/// What a scene file saved, as part of a change list. The bytes may come from anybody.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/scenefile/SceneFile.h"

namespace tessera {

struct SavedOptions {
    ObjectId parent = kRootNode;                ///< the top level is placed below it
    std::uint64_t firstId = kFirstPlaceholder;  ///< of what is created; the others follow it
    // Whatever a scene can hold.
    std::size_t maxObjects = SceneLimits().maxObjects;
    std::size_t maxDepth = SceneLimits().maxDepth - 1;  ///< below the parent; the scene counts its root too
    std::size_t maxTextBytes = SceneLimits().maxTextBytes;
    std::string beside;  ///< what a newer version wrote in the file beside the message: goes into `later`
    /// Sees each object with its refs, and may change or refuse it before it goes into the list. `object` is of the
    /// type.
    std::function<Expected<void>(ObjectId id, const TypeInfo& type, void* object)> look;
};

struct SavedPlace {
    std::uint32_t number = 0;            ///< of the object, as the file counts; 0: it does not
    std::uint32_t line = 0, column = 0;  ///< from 1, where the file was a text
};
struct SavedScene {
    std::uint64_t created = 0;       ///< ids from firstId on
    std::vector<SavedPlace> places;  ///< of each of them
    std::vector<ObjectId> tops;
    LaterParts later;
    std::vector<std::string>
        notes;  ///< what a newer version wrote, in words; of a root that is a node like others, as savedObjectText
    std::vector<std::string>
        unknown;  ///< the parts that a newer version wrote: "shape 70 of CollisionObject (2 times)"
    /// Numbers that became the nearest good ones (`takeNearest`): an earlier version saved them, or a person wrote
    /// them. As savedObjectText.
    std::vector<std::string> mended;
};

/// "line:column: object 7 (Material): why", or "line:column: Material: why" without a number, as errors of `readSaved`
/// begin.
[[nodiscard]] std::string savedObjectText(const SavedPlace& place, std::string_view type, std::string_view why);

/// The notes about a part of a file that is not understood: it is kept, or left out.
[[nodiscard]] std::string laterKeptText(std::string_view what);
[[nodiscard]] std::string laterLeftOutText(std::string_view what);

/// `bytes`: a message Saved; `blobs`: the file's arrays. Creates every object and sets its fields; places the root's
/// children below the parent, or the root itself where it has a name or a core. Errors begin with "line:column: " where
/// the file was a text. Never fails otherwise than with an error; memory stays within a small multiple of the bytes.
[[nodiscard]] Expected<SavedScene> readSaved(ByteSpan bytes, std::span<const Blob> blobs, const SavedOptions& options,
                                             ChangeListBuilder& list);

}  // namespace tessera
