#include "server/rules/CoreRules.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <new>
#include <utility>

#include "common/cores/DistanceLOD.h"
#include "common/cores/Material.h"
#include "common/drawable/Drawable.h"
#include "common/scene/ChildChoice.h"
#include "common/scene/FieldTable.h"
#include "common/scene/MaterialParts.h"

namespace tessera {
namespace {

/// What is asked of some types of cores.
struct CoreRule {
    bool (*isOf)(ObjectType);
    bool (*dependsOn)(const FieldEntry&);
    /// `draft`: as the list leaves it behind; `present`: as it is, or nothing.
    Expected<void> (*check)(const Object& draft, const Object& present);
};

bool dependsOnAll(const FieldEntry&) {
    return true;
}

/// Arrays, and what else says how they are to be read.
bool dependsOnArrays(const FieldEntry& field) {
    return field.kind == FieldKind::kBlob || field.holdsRefs() || (field.effects & (Effect::kShape | Effect::kLook));
}

Expected<void> checkDrawable(const Object& draft, const Object& present) {
    const Drawable sound = drawableOf(present);  // it was committed
    return drawableOf(draft).check(sound && !sound.derived() ? sound.key() : MeshKey());
}

constexpr CoreRule kCoreRules[] = {
    {.isOf = &isDrawable, .dependsOn = &dependsOnArrays, .check = &checkDrawable},
    {.isOf = [](ObjectType type) { return type == typeOf<DistanceLOD>(); },
     .dependsOn = &dependsOnAll,
     .check = [](const Object& draft, const Object&) { return checkRanges(*draft.as<DistanceLOD>()); }},
    {.isOf = [](ObjectType type) { return type == typeOf<Material>(); },
     .dependsOn = &dependsOnAll,
     .check = [](const Object& draft, const Object&) { return checkLayers(*draft.as<Material>()); }},
};

const CoreRule* ruleFor(ObjectType type) {
    const auto* found = std::ranges::find_if(kCoreRules, [&](const CoreRule& rule) { return rule.isOf(type); });
    return found == std::end(kCoreRules) ? nullptr : found;
}

constexpr ObjectType kLastType{std::numeric_limits<std::uint16_t>::max()};

/// A core as a list leaves it behind.
class Draft {
public:
    Draft(const CoreRule& rule, const Object& present)
        : rule_(rule), type_(present.info()), memory_(::operator new(type_.size, kAlignment)) {
        type_.copy(memory_, present.data());
    }
    ~Draft() {
        type_.destroy(memory_);
        ::operator delete(memory_, kAlignment);
    }
    Draft(const Draft&) = delete;
    Draft& operator=(const Draft&) = delete;

    void set(const FieldEntry& field, const FieldValue& value) {
        if (checkValue(field, value)) field.store(memory_, value);
    }
    [[nodiscard]] Expected<void> check(const Object& present) const {
        return rule_.check(Object(type_, memory_), present);
    }
    [[nodiscard]] std::string_view typeName() const { return type_.name; }

private:
    static constexpr std::align_val_t kAlignment{64};
    const CoreRule& rule_;
    const TypeInfo& type_;
    void* memory_;
};

}  // namespace

Expected<void> checkCores(const Aspect& scene, const ChangeList& list) {
    // A list may say of one object that it is of two types. A draft takes fields of its own type alone.
    std::map<std::pair<ObjectId, ObjectType>, Draft> touched;
    const auto draftOf = [&](ObjectId id, const CoreRule& rule, const TypeInfo& type) -> Draft& {
        const auto known = touched.find({id, type.type});
        if (known != touched.end()) return known->second;
        const Object present = scene.find(id);
        const bool fits = present && typeOf(present) == type.type;
        return touched.try_emplace({id, type.type}, rule, fits ? present : type.freshObject()).first->second;
    };
    for (const FieldColumn& column : list.columns) {
        const CoreRule* rule = ruleFor(column.type);
        const TypeInfo* type = rule ? findType(column.type) : nullptr;
        const FieldEntry* field = type ? findField(*type, column.field) : nullptr;
        if (!field || field->kind != column.kind() || field->width != column.width || !rule->dependsOn(*field))
            continue;
        if (column.scalarCount() != column.ids.size() * column.width) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            draftOf(column.ids[row], *rule, *type).set(*field, column.value(row));
    }
    for (const RangeEdit& range : list.ranges)
        if (const CoreRule* rule = ruleFor(range.type))
            if (const TypeInfo* type = findType(range.type))
                if (const FieldEntry* field = findField(*type, range.field))
                    draftOf(range.object, *rule, *type).set(*field, range.result);
    for (const ObjectId id : list.destructions)
        touched.erase(touched.lower_bound({id, {}}), touched.upper_bound({id, kLastType}));
    for (const auto& [object, draft] : touched)
        if (const Expected<void> sound = draft.check(scene.find(object.first)); !sound)
            return failWith(fmt::format("{} #{}", draft.typeName(), object.first.value), sound.error());
    return {};
}

}  // namespace tessera
