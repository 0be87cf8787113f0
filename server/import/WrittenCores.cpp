#include "server/import/WrittenCores.h"

#include <fmt/format.h>

#include <string>

#include "common/drawable/Drawable.h"
#include "common/scenefile/SavedReader.h"
#include "common/scenefile/SceneSchema.h"

namespace tessera {
namespace {

void addNumber(std::string& bytes, std::uint64_t number) {
    for (; number >= 0x80; number >>= 7) bytes.push_back(static_cast<char>(number | 0x80));
    bytes.push_back(static_cast<char>(number));
}
void addField(std::string& bytes, int field, std::uint64_t number) {
    addNumber(bytes, static_cast<std::uint64_t>(field) << 3);
    addNumber(bytes, number);
}
void addField(std::string& bytes, int field, std::string_view value) {
    addNumber(bytes, static_cast<std::uint64_t>(field) << 3 | 2);
    addNumber(bytes, value.size());
    bytes += value;
}

/// As it would stand among what was saved: a message Saved of a root that is nothing but the top, and the one object.
std::string savedAlone(const std::string& core, std::uint64_t at) {
    std::string root, place, object = core, saved;
    addField(root, SceneSchema::kNumber, 1);
    addField(root, SceneSchema::kFirstType + typeOf<Node>().value, "");
    addField(place, 1, at >> 32);
    addField(place, 2, at & 0xffffffffu);
    addField(object, SceneSchema::kNumber, 2);
    addField(object, SceneSchema::kAt, place);
    addField(saved, SceneSchema::kRoot, 1);
    addField(saved, SceneSchema::kObject, root);
    addField(saved, SceneSchema::kObject, object);
    return saved;
}

}  // namespace

Expected<ObjectId> makeWritten(SceneDraft& draft, MaterialCores& materials, LoadedFile& file,
                               const proto::scene::Node& node, const Coating& paint) {
    const Expected<ObjectId> material = materials.worn(file, node.material(), paint);
    if (!material) return material;
    const ObjectId id = draft.nextId();
    SavedOptions options;
    options.firstId = id.value;
    options.look = [&](ObjectId seen, const TypeInfo& type, void* object) -> Expected<void> {
        if (seen == options.parent) return {};
        const Drawable drawable = drawableOf(Object(type, object));
        if (!drawable) return {};
        if (Expected<void> sound = drawable.check(); !sound) return sound;
        if (const FieldEntry* field = findField(type, "material")) field->store(object, *material);
        draft.countDrawable(0);
        draft.countDrawn(0);
        return {};
    };
    const Expected<SavedScene> made = readSaved(asBytes(savedAlone(node.core(), node.at())), {}, options, draft.list());
    if (!made) return tl::unexpected(made.error());
    if (made->created != 1) return fail(ErrorCode::kBadInput, "its core has no type that this version knows");
    for (const std::string& what : made->mended) draft.noteMended(file, what);
    for (const std::string& what : made->unknown)
        draft.note(fmt::format("{}: {}", placeText(file.label, placeOf(node)), laterLeftOutText(what)));
    ++draft.scene().cores;
    draft.took(1);
    return id;
}

}  // namespace tessera
