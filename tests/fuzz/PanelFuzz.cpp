/// The text of a panel, then lists that somebody says with a token of it: only its fields change.
#include <map>
#include <set>
#include <tuple>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Node.h"
#include "common/cores/PointLight.h"
#include "common/cores/Transform.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "server/panel/PanelInScene.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

/// /lamp with a light, /cart with a place, and both once more at /else, which differ in nothing.
ChangeList start() {
    ChangeListBuilder list;
    std::uint64_t next = 2;
    const auto node = [&](ObjectId parent, const std::string& name, ObjectType core) {
        const ObjectId id{next++}, held{next++};
        list.create(id, typeOf<Node>());
        list.create(held, core);
        setField<&Node::name>(list, id, name);
        setField<&Node::core>(list, id, held);
        list.place(id, parent);
        return id;
    };
    (void)node(kRootNode, "lamp", typeOf<PointLight>());
    (void)node(kRootNode, "cart", typeOf<Transform>());
    const ObjectId other = node(kRootNode, "else", typeOf<Transform>());
    (void)node(other, "lamp", typeOf<PointLight>());
    (void)node(other, "cart", typeOf<Transform>());
    return list.take();
}

/// As people write them, or any bytes.
template <typename Number>
Number numberFrom(FuzzInput& in) {
    return in.below(2) == 0 ? static_cast<Number>(in.below(16)) / 4 : in.number<Number>();
}

FieldValue valueOf(const FieldEntry& field, FuzzInput& in) {
    switch (field.kind) {
        case FieldKind::kFloat: {
            Floats value{.width = field.width};
            for (std::size_t i = 0; i < field.width; ++i) value.values[i] = numberFrom<float>(in);
            return value;
        }
        case FieldKind::kDouble: {
            Doubles value{.width = field.width};
            for (std::size_t i = 0; i < field.width; ++i) value.values[i] = numberFrom<double>(in);
            return value;
        }
        case FieldKind::kInt:
            return in.number<std::int64_t>();
        case FieldKind::kRef:
            return ObjectId(in.below(14));
        case FieldKind::kText:
            return std::string(asText(in.bytes(in.below(40))));
        case FieldKind::kBool:
            return in.below(2) == 1;
        case FieldKind::kBlob:
            return Blob();
        case FieldKind::kRefs:
            return RefList{ObjectId(in.below(14))};
        case FieldKind::kMatrix:
            return Matrix();
    }
    std::abort();
}

using Place = std::tuple<ObjectId, ObjectType, FieldId>;
std::map<Place, FieldValue> valuesIn(const ChangeList& list) {
    std::map<Place, FieldValue> values;
    for (const FieldColumn& column : list.columns)
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            values[{column.ids[row], column.type, column.field}] = column.value(row);
    return values;
}

/// One list: some fields of some objects, or bytes as they come.
Expected<ChangeList> saidBy(FuzzInput& in, const Aspect& scene) {
    if (in.below(8) == 0) return decodeChangeList(in.bytes(in.below(512)), BlobStore(), AbsentBlobs::kKeepAbsent);
    ChangeListBuilder list;
    for (std::size_t sets = 1 + in.below(3); sets > 0; --sets) {
        const ObjectId id{1 + in.below(11)};
        const TypeInfo& type = scene.find(id).info();
        const FieldEntry& field = type.fields[in.below(type.fields.size())];
        list.set(id, type.type, field.id, valueOf(field, in));
    }
    return list.take();
}

void run(FuzzInput in) {
    const ByteSpan text = in.bytes(in.number<std::uint16_t>());
    const Expected<Panel> panel = parsePanel(asText(text), "fuzz.panel");
    if (!panel) return must(!panel.error().message.empty(), "a refusal has words");
    must(panel->controls.size() <= Panel::kMostControls, "no more controls than a panel may have");
    std::set<std::string, std::less<>> fields;
    for (const PanelControl& control : panel->controls) {
        fields.insert(control.of.field);
        if (const auto* press = std::get_if<PanelPress>(&control.as))
            for (const PanelPress::Set& set : press->sets) fields.insert(set.of.field);
    }
    Aspect scene;
    must(scene.apply(start()).has_value(), "the scene to begin with is sound");
    while (!in.empty()) {
        const Expected<ChangeList> said = saidBy(in, scene);
        const PanelInScene reach(*panel, scene);
        if (!said || reach.whyNot(*said)) continue;
        const ChangeList before = snapshot(scene);
        if (!scene.apply(*said)) continue;
        const ChangeList after = snapshot(scene);
        must(before.creations == after.creations && before.placements == after.placements, "a panel moves no nodes");
        std::map<Place, FieldValue> were = valuesIn(before);
        for (const auto& [place, value] : valuesIn(after)) {
            const auto was = were.find(place);
            const bool same = was != were.end() && was->second == value;
            if (was != were.end()) were.erase(was);
            if (same) continue;
            const auto& [id, type, field] = place;
            const TypeInfo* const of = findType(type);
            const FieldEntry* const known = of ? findField(*of, field) : nullptr;
            must(reach.holds(id) && known && fields.contains(known->name), "a panel writes its own fields");
        }
        for (const auto& [place, value] : were)
            must(reach.holds(std::get<0>(place)), "a panel takes back its own fields");
    }
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
