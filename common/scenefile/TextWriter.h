/// A scene as a person would write it. Internal to this folder; README.md has the form.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

struct WrittenText {
    std::string inside;        ///< of `saved { … }`, without its arrays
    std::vector<Blob> arrays;  ///< named by their number, counted from 1
};
/// Of a text, and of the arrays beside it.
inline constexpr std::size_t kMaxSceneFileBytes = 0x7fffffff;
[[nodiscard]] tl::unexpected<Error> sceneTooLarge();

/// The root, what is below it, and whatever these refer to, each followed by what it refers to. Binary files have the
/// same.
struct ObjectsToSave {
    std::vector<ObjectId> order;
    std::unordered_map<ObjectId, std::uint32_t> places;  ///< in `order`
};
[[nodiscard]] ObjectsToSave objectsToSave(const Aspect& scene);

/// kRefused: an array is not here.
[[nodiscard]] Expected<WrittenText> writeNested(const Aspect& scene);

/// A file of it whose arrays stand in it, or lie in the file beside it of that name. kLimit: more than 2 GiB.
[[nodiscard]] Expected<std::string> textWithArrays(const WrittenText& text);
[[nodiscard]] Expected<std::string> textBesideArrays(const WrittenText& text, const std::string& file,
                                                     const std::string& id);

}  // namespace tessera
