#include "common/scene/FieldLayout.h"

#include <vector>

namespace tessera {

namespace {

std::vector<std::vector<FieldLayout>> measureAll() {
    std::vector<std::vector<FieldLayout>> all;
    for (const TypeInfo& type : allTypes()) {
        Object object = type.make();
        std::vector<FieldLayout>& fields = all.emplace_back();
        for (const FieldInfo& field : type.fields)
            fields.push_back(
                {&field, static_cast<std::byte*>(field.at(object)) - reinterpret_cast<std::byte*>(&object)});
    }
    return all;
}

}  // namespace

std::span<const FieldLayout> layoutOf(std::size_t alternative) {
    static const std::vector<std::vector<FieldLayout>> kAll = measureAll();
    return kAll[alternative];
}

const FieldLayout& layoutOf(std::size_t alternative, FieldId field) {
    for (const FieldLayout& layout : layoutOf(alternative))
        if (layout.info->id == field) return layout;
    TESSERA_CHECK(false, "a type has no such field");
    return layoutOf(alternative)[0];
}

}  // namespace tessera
