/// Where the fields lie inside an Object, for passes over very many objects. Internal to common/scene.
///
/// A variant holds all its alternatives at one place, so a field has one distance from the object's start. With it a
/// pass touches the memory of the field alone: FieldInfo::at would look at the variant's index too, which lies far
/// behind.
#pragma once

#include <span>

#include "common/scene/FieldTable.h"

namespace tessera {

struct FieldLayout {
    const FieldInfo* info = nullptr;
    std::ptrdiff_t offset = 0;

    /// The caller knows that the object is of the field's type.
    template <typename T>
    [[nodiscard]] T* in(Object& object) const {
        return reinterpret_cast<T*>(reinterpret_cast<std::byte*>(&object) + offset);
    }
    template <typename T>
    [[nodiscard]] const T* in(const Object& object) const {
        return reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(&object) + offset);
    }
};

/// The fields of the type with this index in Object, in the order of its table.
[[nodiscard]] std::span<const FieldLayout> layoutOf(std::size_t alternative);
[[nodiscard]] const FieldLayout& layoutOf(std::size_t alternative, FieldId field);

}  // namespace tessera
