/// The one table of types and fields, derived from their descriptions (Field.h). Codec, snapshot, inverse, hash, files
/// and tools see only this: fields and values.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/field/LightSource.h"
#include "common/field/NodePose.h"
#include "common/scene/Object.h"
#include "common/scene/SceneTypes.h"

namespace tessera {

/// A field, and where it lies in its struct.
struct FieldEntry : FieldInfo {
    std::uint32_t offset = 0;  ///< in bytes from the object's start

    template <typename T>
    [[nodiscard]] T* in(void* object) const {
        return reinterpret_cast<T*>(static_cast<std::byte*>(object) + offset);
    }
    template <typename T>
    [[nodiscard]] const T* in(const void* object) const {
        return reinterpret_cast<const T*>(static_cast<const std::byte*>(object) + offset);
    }
    [[nodiscard]] FieldValue load(const Object& object) const { return read(object.data()); }
    void store(void* object, const FieldValue& value) const { write(object, value); }
};

struct TypeInfo {
    ObjectType type;
    std::uint16_t index = 0;  ///< its place in allTypes()
    std::string_view name;    ///< e.g. "Transform"
    bool isCore = true;       ///< may be a node's core (Material and Image may not)
    std::span<const FieldEntry> fields;
    Effect effects = Effect::kNone;  ///< of all its fields together
    bool refers = false;             ///< some field is a ref or a list of them

    std::size_t size = 0, alignment = 0;  ///< of its struct
    void (*construct)(void*) = nullptr;   ///< a fresh one at this place
    void (*destroy)(void*) = nullptr;
    void (*copy)(void*, const void*) = nullptr;  ///< a copy at this place; null for nodes
    /// Over all fields as they lie there. -0 counts as 0. `seed` goes in too.
    std::uint64_t (*hash)(const void*, std::uint64_t seed) = nullptr;
    /// Null: it leaves its node where it is.
    NodePose (*pose)(const void*) = nullptr;
    /// Where a node with this core stands below a parent; null as `pose`. The one product that everybody makes: the
    /// same bits.
    void (*place)(const void*, const Affine3d& world_T_parent, Affine3d& world_T_node) = nullptr;
    /// Null: it does not shine.
    LightSource (*light)(const void*) = nullptr;
    const void* fresh = nullptr;  ///< an object with all defaults
    [[nodiscard]] Object freshObject() const { return {*this, fresh}; }
};

[[nodiscard]] std::span<const TypeInfo> allTypes();
/// Null where the number or name is unknown.
[[nodiscard]] const TypeInfo* findType(ObjectType type);
[[nodiscard]] const TypeInfo* findType(std::string_view name);
[[nodiscard]] const FieldEntry* findField(const TypeInfo& type, FieldId field);
[[nodiscard]] const FieldEntry* findField(const TypeInfo& type, std::string_view name);

[[nodiscard]] inline ObjectType typeOf(const Object& object) {
    return object.info().type;
}
template <typename T>
const T* Object::as() const {
    return data_ && type_->index == kTypeIndex<T> ? static_cast<const T*>(data_) : nullptr;
}
template <typename T>
Object Object::of(const T& value) {
    return {allTypes()[kTypeIndex<T>], &value};
}

/// Hash over numbers, names, kinds, widths, references, words and bounds of all types and fields. Two programs with
/// different hashes do not understand each other's change lists.
[[nodiscard]] std::uint64_t schemaHash();

/// Every ref of an object that is not "none", as often as it is held.
void forEachRef(const Object& object, const std::function<void(ObjectId)>& visit);

/// What a column, or a whole list, may alter in what is derived from the scene. Placements count as structure;
/// creations and destructions alone as nothing, because what is not placed is not seen.
[[nodiscard]] Effect effectsOf(ObjectType type, FieldId field);
[[nodiscard]] inline Effect effectsOf(const FieldColumn& column) {
    return effectsOf(column.type, column.field);
}
[[nodiscard]] Effect effectsOf(const ChangeList& list);

/// The number that a word names: of flags also several with commas between them, or "none". Numbers themselves are no
/// words.
[[nodiscard]] std::optional<std::int64_t> numberOfWord(const FieldInfo& field, std::string_view word);
/// The word for a number, where it has one.
[[nodiscard]] std::optional<std::string> wordOfNumber(const FieldInfo& field, std::int64_t number);

/// Why a value cannot be one of this field, whatever the scene: another kind or width, a number that is not finite or
/// out of its bounds, a word that is none, a rotation without direction. Refs are not looked up.
[[nodiscard]] Expected<void> checkValue(const FieldInfo& field, const FieldValue& value);
/// For readers of files: brings finite numbers of a field that says so (`FieldInfo::nearestFromFiles`) within its
/// bounds, and says what became of the first of them: "roughness 9 is not between 0 and 1: 1 is taken". Empty: it is as
/// it was.
[[nodiscard]] std::string takeNearest(const FieldInfo& field, FieldValue& value);

/// A C++ value as a FieldValue, by the type of its member.
template <typename T>
[[nodiscard]] FieldValue toValue(const T& value) {
    return FieldShape<T>::load(value);
}

/// Sets one member of one object: `setField<&Transform::translation>(list, id, Vec3d(1, 0, 0))`.
template <auto kMember>
void setField(ChangeListBuilder& list, ObjectId id, const typename FieldMember<decltype(kMember)>::Type& value) {
    using Member = FieldMember<decltype(kMember)>;
    using Shape = FieldShape<typename Member::Type>;
    if constexpr (requires { Shape::numbers(value); }) {
        const auto numbers = Shape::numbers(value);
        list.set(id, typeOf<typename Member::Core>(), fieldId<kMember>, std::span(numbers));
    } else {
        list.set(id, typeOf<typename Member::Core>(), fieldId<kMember>, toValue(value));
    }
}
/// Sets all fields of an object that are not as in a fresh one.
void setAllFields(ChangeListBuilder& list, ObjectId id, const Object& object);

}  // namespace tessera
