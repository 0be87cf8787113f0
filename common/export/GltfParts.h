/// A glTF 2.0 file as it grows: its lists, and the bytes of its one buffer.
#pragma once

#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/base/Blob.h"
#include "common/export/JsonText.h"
#include "common/export/LeavingBytes.h"

namespace tessera {

// glTF 2.0, "accessor.componentType" and "bufferView.target".
inline constexpr int kGltfByte = 5121, kGltfShort = 5123, kGltfInt = 5125, kGltfFloat = 5126;
inline constexpr int kGltfVertices = 34962, kGltfIndices = 34963, kGltfNoTarget = 0;

struct GltfParts {
    JsonArray nodes, meshes, materials, textures, samplers, images, cameras, lights, skins, animations;
    std::set<std::string> extensions;  ///< in use

    /// The place of a view of these bytes, which are shared and not copied.
    int addView(ByteSlice bytes, int target = kGltfNoTarget);
    /// `kind`: "SCALAR", "VEC3" …; `more`: members beside, as `"normalized":true`.
    int addAccessor(int view, int component, std::string_view kind, std::size_t count, std::string_view more = {},
                    std::size_t offset = 0);

    /// Accessors of floats, one for each blob and kind; numbers that are none become 0. With `bounds` it says the least
    /// and greatest of each component.
    int floats(const Blob& blob, std::string_view kind, std::size_t components, bool bounds = false);
    /// The same of numbers that no blob has.
    int floats(std::vector<float> values, std::string_view kind, std::size_t components, bool bounds, int target);
    /// Indices below `vertices`, in 16 bits where these do.
    int indices(const Blob& blob, std::size_t vertices);

    [[nodiscard]] const std::vector<ByteSlice>& buffer() const { return buffer_; }
    [[nodiscard]] std::uint64_t bufferBytes() const { return bufferBytes_; }
    [[nodiscard]] const JsonArray& views() const { return views_; }
    [[nodiscard]] const JsonArray& accessors() const { return accessors_; }

private:
    struct Known {
        BlobId blob;
        std::string kind;
        bool bounds = false;
        bool operator==(const Known&) const = default;
    };
    struct KnownHash {
        std::size_t operator()(const Known& known) const {
            return std::hash<BlobId>{}(known.blob) ^ std::hash<std::string>{}(known.kind) ^ std::size_t{known.bounds};
        }
    };
    std::unordered_map<Known, int, KnownHash> known_;
    JsonArray views_, accessors_;
    std::vector<ByteSlice> buffer_;
    std::uint64_t bufferBytes_ = 0;
};

}  // namespace tessera
