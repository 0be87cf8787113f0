#include "common/scene/Users.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <unordered_set>
#include <utility>
#include <vector>

#include "common/scene/Text.h"

namespace tessera {
namespace {

constexpr std::size_t kMostNamed = 3, kMostLookedAt = 1'000'000, kMostPathBytes = 200;

bool refersTo(const FieldValue& value, ObjectId id) {
    if (const auto* ref = std::get_if<ObjectId>(&value)) return *ref == id;
    const auto* refs = std::get_if<RefList>(&value);
    return refs && std::ranges::find(*refs, id) != refs->end();
}

/// Each once, those that the list says something of first.
std::vector<ObjectId> usersOf(const Aspect& aspect, const ChangeList& list, const std::vector<ObjectId>& ids,
                              ObjectId id) {
    std::vector<ObjectId> users;
    std::unordered_set<ObjectId> known(list.destructions.begin(), list.destructions.end());
    std::set<std::pair<ObjectId, std::uint32_t>> said;  // by the list
    const auto add = [&](ObjectId object, const FieldValue& value) {
        if (refersTo(value, id) && known.insert(object).second) users.push_back(object);
    };
    for (const FieldColumn& column : list.columns) {
        if (column.kind() != FieldKind::kRef && column.kind() != FieldKind::kRefs) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            said.emplace(column.ids[row], column.field.value);
            add(column.ids[row], column.value(row));
        }
    }
    for (const ObjectId user : ids) {
        const Object object = aspect.find(user);
        for (const FieldEntry& field : object.info().fields)
            if (field.holdsRefs() && !said.contains({user, field.id.value})) add(user, field.load(object));
    }
    return users;
}

}  // namespace

std::string usersInWords(const Aspect& aspect, const ChangeList& list, ObjectId id, std::int64_t references) {
    if (aspect.objectCount() > kMostLookedAt)
        return fmt::format("others, by {} reference{}", references, references == 1 ? "" : "s");
    const std::vector<ObjectId> ids = aspect.ids();
    const std::vector<ObjectId> users = usersOf(aspect, list, ids, id);
    const auto pathFor = [&](ObjectId user) {
        if (aspect.get<Node>(user)) return pathOf(aspect, user);
        const auto bearer = std::ranges::find_if(ids, [&](ObjectId one) {
            const Node* node = aspect.get<Node>(one);
            return node && node->core == user;
        });
        return bearer == ids.end() ? std::string() : pathOf(aspect, *bearer);
    };
    std::string words = fmt::format("{} other object{}", users.size(), users.size() == 1 ? "" : "s");
    for (std::size_t i = 0; i < std::min(users.size(), kMostNamed); ++i) {
        const Object object = aspect.find(users[i]);
        const std::string path = object ? pathFor(users[i]) : std::string();
        words += i == 0 ? ": " : ", ";
        if (!object)
            words += "one that it creates";
        else
            words +=
                fmt::format("{} ({})", path.empty() ? fmt::format("#{}", users[i].value) : toUtf8(path, kMostPathBytes),
                            object.info().name);
    }
    if (users.size() > kMostNamed) words += fmt::format(", and {} more", users.size() - kMostNamed);
    return words;
}

}  // namespace tessera
