#include "server/rules/ImageCheck.h"

#include <algorithm>
#include <array>
#include <map>

#include "common/cores/Image.h"
#include "common/drawable/ImageLayout.h"

namespace tessera {

Sound checkImages(const Aspect& scene, const ChangeList& list) {
    std::map<ObjectId, Image> touched;
    const auto draftOf = [&](ObjectId id) -> Image& {
        const auto known = touched.find(id);
        if (known != touched.end()) return known->second;
        const Image* present = scene.get<Image>(id);
        return touched.emplace(id, present ? *present : Image()).first->second;
    };
    const TypeInfo& type = *findType(typeOf<Image>());
    static constexpr std::array kLayout = {
        fieldId<&Image::pixels>, fieldId<&Image::widthPx>, fieldId<&Image::heightPx>, fieldId<&Image::encoding>,
        fieldId<&Image::shape>,  fieldId<&Image::depthPx>, fieldId<&Image::mipmaps>};
    const auto isLayout = [](FieldId field) {
        return std::find(kLayout.begin(), kLayout.end(), field) != kLayout.end();
    };
    for (const FieldColumn& column : list.columns) {
        if (column.type != type.type || !isLayout(column.field)) continue;
        const FieldEntry* field = findField(type, column.field);
        if (field->kind != column.kind() || field->width != column.width || column.scalarCount() != column.ids.size())
            continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            if (const FieldValue value = column.value(row); checkValue(*field, value))
                field->store(&draftOf(column.ids[row]), value);
    }
    for (const RangeEdit& range : list.ranges)
        if (range.type == type.type && range.field == fieldId<&Image::pixels>)
            draftOf(range.object).pixels = range.result;
    for (const ObjectId id : list.destructions) touched.erase(id);
    for (const auto& [id, image] : touched)
        if (const Expected<void> sound = checkImage(image); !sound)
            return tl::unexpected(Fault{id, typeOf<Image>(), sound.error()});
    return {};
}

}  // namespace tessera
