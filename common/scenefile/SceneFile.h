/// Scenes as files: `.tsc` (binary) and `.tsct` (text) of one message, made from the table of types. Whatever a scene
/// holds is saved exactly; a new type of object needs no line here.
///
/// The authors' way of writing a scene (shapes, repeats, definitions, imports) stands in the same message beside what
/// is saved (proto/scene.proto); `server/import` reads both.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

enum class SceneEncoding : std::uint8_t { kText, kBinary };
/// By a file's extension: .tsct is text, .tsc binary. kUsage otherwise.
[[nodiscard]] Expected<SceneEncoding> sceneEncodingOf(const std::string& path);

/// What a file of a newer version holds and this one does not know. A scene cannot hold it; whoever writes the scene of
/// that file again hands it over.
struct LaterParts {
    /// As the file numbered its objects and arrays: what is not known may name them.
    std::map<ObjectId, std::uint32_t> numbers;
    std::vector<Blob> blobs;
    struct Fields {
        std::string ofObject, ofValue;  ///< protobuf's bytes
    };
    std::map<ObjectId, Fields> fields;
    std::vector<std::string> objects;  ///< of types that are not known, whole
    /// Refs that lead to such objects: how the file had the whole field.
    std::map<std::pair<ObjectId, FieldId>, std::vector<std::uint32_t>> refs;
    struct Word {
        std::int64_t ofFile, read;  ///< `read`: what the scene has for it
    };
    std::map<std::pair<ObjectId, FieldId>, Word> words;  ///< of an enumeration or of flags
    std::string ofSaved, ofFile;

    [[nodiscard]] bool empty() const {
        return fields.empty() && objects.empty() && words.empty() && ofSaved.empty() && ofFile.empty();
    }
    template <typename Replace>
    void replaceIds(Replace&& replace) {
        LaterParts next = *this;
        next.numbers.clear(), next.fields.clear(), next.refs.clear(), next.words.clear();
        for (const auto& [id, number] : numbers) next.numbers[replace(id)] = number;
        for (auto& [id, unknown] : fields) next.fields[replace(id)] = std::move(unknown);
        for (auto& [at, list] : refs) next.refs[{replace(at.first), at.second}] = std::move(list);
        for (const auto& [at, word] : words) next.words[{replace(at.first), at.second}] = word;
        *this = std::move(next);
    }
};

/// The bytes of a file that holds its arrays itself: every node below the root, and whatever these refer to. Nodes
/// taken out of the tree are left out, unless something refers to them. kRefused: an array is not here; kLimit: more
/// than a file can hold (2 GiB).
[[nodiscard]] Expected<std::string> writeScene(const Aspect& scene, SceneEncoding encoding,
                                               const LaterParts& later = {});
/// Replaces the file at once, or leaves it as it was. A file that is there keeps its rights, a link leads to the file.
/// Large arrays of a text go into a file beside it first (`arrays`: its path; empty: there are none). The file that the
/// text before named goes last, unless another file in the folder names it.
[[nodiscard]] Expected<void> saveScene(const std::string& path, const Aspect& scene, const LaterParts& later = {},
                                       std::string* arrays = nullptr);

/// The description of scene files as protobuf's language has it, for other languages.
[[nodiscard]] std::string sceneSchemaText();

}  // namespace tessera
