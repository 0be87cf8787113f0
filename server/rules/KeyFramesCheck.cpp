#include "server/rules/KeyFramesCheck.h"

#include <algorithm>
#include <map>

#include "common/animation/KeyTrack.h"

namespace tessera {

Sound checkKeyFrames(const Aspect& scene, const ChangeList& list) {
    std::map<ObjectId, KeyFrames> touched;
    const auto draftOf = [&](ObjectId id) -> KeyFrames& {
        const auto known = touched.find(id);
        if (known != touched.end()) return known->second;
        const KeyFrames* present = scene.get<KeyFrames>(id);
        return touched.emplace(id, present ? *present : KeyFrames()).first->second;
    };
    const TypeInfo& type = *findType(typeOf<KeyFrames>());
    for (const FieldColumn& column : list.columns) {
        const FieldEntry* field = column.type == type.type ? findField(type, column.field) : nullptr;
        if (!field || field->kind != column.kind() || field->width != column.width ||
            column.scalarCount() != column.ids.size())
            continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            if (const FieldValue value = column.value(row); checkValue(*field, value))
                field->store(&draftOf(column.ids[row]), value);
    }
    for (const RangeEdit& range : list.ranges)
        if (const FieldEntry* field = range.type == type.type ? findField(type, range.field) : nullptr;
            field && field->kind == FieldKind::kBlob)
            field->store(&draftOf(range.object), range.result);
    for (const ObjectId id : list.destructions) touched.erase(id);
    if (touched.empty()) return {};
    std::map<ObjectId, ObjectType> created;
    for (const Creation& creation : list.creations) created.emplace(creation.id, creation.type);
    for (const auto& [id, frames] : touched) {
        if (isBlank(frames)) continue;
        const Object target = frames.target ? scene.find(frames.target) : Object();
        const auto fresh = created.find(frames.target);
        const TypeInfo* targetType = target                   ? &target.info()
                                     : fresh != created.end() ? findType(fresh->second)
                                                              : nullptr;
        if (const Expected<KeyTrack> sound = KeyTrack::of(frames, targetType); !sound)
            return tl::unexpected(Fault{id, typeOf<KeyFrames>(), sound.error()});
    }
    return {};
}

}  // namespace tessera
