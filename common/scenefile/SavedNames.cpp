#include "common/scenefile/SavedNames.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/Nearest.h"
#include "common/base/Utf8.h"
#include "common/scenefile/TextForm.h"

namespace tessera {
namespace {

constexpr std::size_t kMostNotes = 20;
// A name that is told of has so many bytes, and is compared with so many.
constexpr std::size_t kMostShown = 200, kMostKnown = 100'000;
// What a field may lead to, beside one type.
constexpr std::uint64_t kAnyCore = 0x10000, kAnything = 0x10001;

std::uint64_t keyOf(std::size_t name, std::uint64_t target) {
    return static_cast<std::uint64_t>(name) << 20 | target;
}
std::uint64_t targetOf(const FieldEntry& field) {
    return field.refType ? field.refType->value : field.anyObject ? kAnything : kAnyCore;
}

std::string describe(const FieldEntry& field) {
    if (field.refType) return std::string(tessera::findType(*field.refType)->name);
    return field.anyObject ? "object" : "core";
}

}  // namespace

std::size_t SavedNames::intern(const std::string& name) {
    const auto [at, isNew] = places_.try_emplace(name, names_.size());
    if (isNew) names_.push_back(name);
    return at->second;
}

void SavedNames::enter(const std::string& name, std::size_t item, bool byNode) {
    const auto place = places_.find(name);
    if (name.empty() || place == places_.end()) return;
    const TypeInfo& type = *items_[item].type->info;
    candidates_[keyOf(place->second, type.type.value)].push_back(item);
    if (type.isCore && type.type != typeOf<Node>()) candidates_[keyOf(place->second, kAnyCore)].push_back(item);
    if (!byNode) candidates_[keyOf(place->second, kAnything)].push_back(item);
}

Expected<void> SavedNames::resolve(std::vector<SavedRef>& refs, std::vector<std::string>& notes) {
    for (std::size_t i = 0; i < items_.size(); ++i) {
        const SavedItem& item = items_[i];
        enter(item.id, i, false);
        if (item.name != item.id) enter(item.name, i, false);
        if (item.core != kNoItem && item.name != items_[item.core].id) enter(item.name, item.core, true);
    }
    for (auto& [key, some] : candidates_) std::sort(some.begin(), some.end());
    for (SavedRef& ref : refs) {
        if (ref.kind != SavedRef::Kind::kName) continue;
        const std::string& name = names_[ref.target];
        const FieldEntry& field = *ref.field->entry;
        if (name == textform::kRootName && field.mayReferTo(typeOf<Node>(), false)) {
            ref.kind = SavedRef::Kind::kObject;
            ref.target = 0;
            continue;
        }
        const auto found = candidates_.find(keyOf(ref.target, targetOf(field)));
        if (found == candidates_.end()) return unknown(ref);
        const std::vector<std::size_t>& some = found->second;
        auto first = some.begin(), last = some.end();
        for (std::size_t around = ref.item; around != kNoItem; around = items_[around].around) {
            const auto from = std::lower_bound(some.begin(), some.end(), around);
            if (from == some.end() || *from >= items_[around].end) continue;
            first = from;
            last = std::lower_bound(from, some.end(), items_[around].end);
            break;
        }
        if (last - first > 1 && notes.size() < kMostNotes)
            notes.push_back(fmt::format(
                "{}:{}: '{}' means several objects, in the lines {} and {}{}: the first is taken", ref.line, ref.column,
                name, items_[*first].line, items_[*(first + 1)].line, last - first > 2 ? " and more" : ""));
        ref.kind = SavedRef::Kind::kObject;
        ref.target = *first;
    }
    return {};
}

tl::unexpected<Error> SavedNames::unknown(const SavedRef& ref) const {
    const std::string& name = names_[ref.target];
    const std::string shown(cutUtf8(name, kMostShown));
    const FieldEntry& field = *ref.field->entry;
    const std::string wanted = describe(field);
    std::vector<std::string> known;
    for (const SavedItem& item : items_) {
        if (item.id == name || item.name == name)
            return fail(ErrorCode::kBadInput,
                        fmt::format("{}:{}: {} leads to a {}, and '{}' is of type {}", ref.line, ref.column,
                                    ref.field->descriptor->name(), wanted, shown, item.type->info->name));
        const TypeInfo& type = *item.type->info;
        if (field.mayReferTo(type.type, type.isCore)) {
            known.push_back(item.id);
            known.push_back(item.name);
        }
        if (known.size() > kMostKnown) break;
        if (item.core != kNoItem && field.mayReferTo(items_[item.core].type->info->type, true))
            known.push_back(item.name);
    }
    std::erase_if(known, [](const std::string& other) { return other.empty() || other.size() > kMostShown; });
    const std::string nearest = name.size() > kMostShown ? std::string() : nearestName(name, known);
    return fail(ErrorCode::kBadInput,
                fmt::format("{}:{}: {}: there is no {} '{}'{}", ref.line, ref.column, ref.field->descriptor->name(),
                            wanted, shown, nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

}  // namespace tessera
