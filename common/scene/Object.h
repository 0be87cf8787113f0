/// An object of the scene, whatever its type.
#pragma once

#include "common/field/Field.h"

namespace tessera {

struct TypeInfo;

/// Looks at an object where it lies, or at nothing. Cheap to copy; holds as long as the object stands there.
class Object {
public:
    Object() = default;
    Object(const TypeInfo& type, const void* data) : type_(&type), data_(data) {}
    /// A struct of one of the scene's types.
    template <typename T>
    [[nodiscard]] static Object of(const T& value);

    [[nodiscard]] explicit operator bool() const { return data_ != nullptr; }
    /// Only of an object that is there.
    [[nodiscard]] const TypeInfo& info() const { return *type_; }
    [[nodiscard]] const void* data() const { return data_; }
    /// Null where it is of another type, or nothing.
    template <typename T>
    [[nodiscard]] const T* as() const;
    template <typename T>
    [[nodiscard]] bool is() const {
        return as<T>() != nullptr;
    }

private:
    const TypeInfo* type_ = nullptr;
    const void* data_ = nullptr;
};

}  // namespace tessera
