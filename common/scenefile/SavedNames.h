/// Who is meant by the names in a saved text. Internal to this folder.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/base/Error.h"
#include "common/scenefile/SceneSchema.h"

namespace tessera {

inline constexpr std::size_t kNoItem = static_cast<std::size_t>(-1);

/// An object of the text. They stand in its order, each followed by all that is inside of it.
struct SavedItem {
    const SceneSchema::Type* type = nullptr;
    int line = 0, column = 0;      ///< from 1
    std::size_t around = kNoItem;  ///< what it stands in
    std::size_t end = 0;           ///< what stands in it is before that
    std::string id;
    std::string name;                            ///< of a Node
    std::size_t core = kNoItem;                  ///< of a Node, where it stands inside
    std::vector<std::uint32_t> children;         ///< numbers
    std::size_t valueBegin = 0, valueBytes = 0;  ///< its fields that are no references
};

/// What a field of an object leads to.
struct SavedRef {
    enum class Kind : std::uint8_t { kObject, kName, kNamedArray, kOwnArray };
    std::size_t item = 0;  ///< whose field it is
    const SceneSchema::Field* field = nullptr;
    int line = 0, column = 0;  ///< from 1
    Kind kind = Kind::kObject;
    std::size_t target = 0;  ///< an object's place, a name's, an array's number, or the place of one of its own
};

/// A name means an object of a type that the field may lead to: one with that id, a node of that name, or the core of a
/// node of that name. Of several the one nearest around the reference, as names of authors do: in the innermost object
/// that holds any. Of several there the first, with a note.
class SavedNames {
public:
    explicit SavedNames(const std::vector<SavedItem>& items) : items_(items) {}

    [[nodiscard]] std::size_t intern(const std::string& name);
    /// Replaces all names. Errors begin with "line:column: ".
    [[nodiscard]] Expected<void> resolve(std::vector<SavedRef>& refs, std::vector<std::string>& notes);

private:
    void enter(const std::string& name, std::size_t item, bool byNode);
    [[nodiscard]] tl::unexpected<Error> unknown(const SavedRef& ref) const;

    const std::vector<SavedItem>& items_;
    std::unordered_map<std::string, std::size_t> places_;
    std::vector<std::string> names_;
    std::unordered_map<std::uint64_t, std::vector<std::size_t>> candidates_;  ///< by name and what a field may lead to
};

}  // namespace tessera
