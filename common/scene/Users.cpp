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

struct User {
    ObjectId object;
    std::int64_t references = 0;
};

std::int64_t countIn(const FieldValue& value, ObjectId id) {
    if (const auto* ref = std::get_if<ObjectId>(&value)) return *ref == id ? 1 : 0;
    const auto* refs = std::get_if<RefList>(&value);
    return refs ? std::ranges::count(*refs, id) : 0;
}

/// The first few, and how often each refers to it.
std::vector<User> usersOf(const Aspect& aspect, const ChangeList& list, const std::vector<ObjectId>& ids, ObjectId id) {
    std::vector<User> users;
    const std::unordered_set<ObjectId> destroyed(list.destructions.begin(), list.destructions.end());
    std::set<std::pair<ObjectId, std::uint32_t>> said;  // by the list
    const auto count = [&](ObjectId object, std::int64_t references) {
        if (references == 0 || destroyed.contains(object)) return;
        if (users.empty() || users.back().object != object) users.push_back({object, 0});
        users.back().references += references;
    };
    for (const FieldColumn& column : list.columns) {
        if (column.kind() != FieldKind::kRef && column.kind() != FieldKind::kRefs) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            said.emplace(column.ids[row], column.field.value);
            count(column.ids[row], countIn(column.value(row), id));
        }
    }
    for (const ObjectId user : ids) {
        if (users.size() > kMostNamed) break;
        const Object object = aspect.find(user);
        for (const FieldEntry& field : object.info().fields)
            if (field.holdsRefs() && !said.contains({user, field.id.value})) count(user, countIn(field.load(object), id));
    }
    if (users.size() > kMostNamed) users.resize(kMostNamed);
    return users;
}

}  // namespace

std::string usersInWords(const Aspect& aspect, const ChangeList& list, ObjectId id, std::int64_t uses) {
    if (aspect.objectCount() > kMostLookedAt) return {};
    const std::vector<ObjectId> ids = aspect.ids();
    const std::vector<User> users = usersOf(aspect, list, ids, id);
    const auto pathFor = [&](ObjectId user) {
        if (aspect.get<Node>(user)) return pathOf(aspect, user);
        const auto bearer = std::ranges::find_if(ids, [&](ObjectId one) {
            const Node* node = aspect.get<Node>(one);
            return node && node->core == user;
        });
        return bearer == ids.end() ? std::string() : pathOf(aspect, *bearer);
    };
    std::string words;
    for (const User& user : users) {
        const Object object = aspect.find(user.object);
        const std::string path = object ? pathFor(user.object) : std::string();
        words += words.empty() ? ": " : ", ";
        if (!object)
            words += "one that it creates";
        else
            words += fmt::format("{} ({})", path.empty() ? fmt::format("#{}", user.object.value) : toUtf8(path, kMostPathBytes), object.info().name);
        uses -= user.references;
    }
    if (!words.empty() && uses > 0) words += fmt::format(", and {} more", uses);
    return words;
}

}  // namespace tessera
