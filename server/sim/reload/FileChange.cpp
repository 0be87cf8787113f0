#include "server/sim/reload/FileChange.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

namespace tessera {

namespace {

std::vector<std::uint32_t> matched(const HeldFile& former, const FileObjects& before, const FileObjects& after) {
    std::vector<std::uint32_t> formerOf = matchObjects(before, after);
    if (former.leftOut.empty()) return formerOf;
    const std::unordered_set<std::uint32_t> leftOut(former.leftOut.begin(), former.leftOut.end());
    for (std::uint32_t& place : formerOf)
        if (leftOut.contains(place)) place = FileObjects::kNone;
    return formerOf;
}

}  // namespace

FileChange::FileChange(std::shared_ptr<const HeldFile> formerFile, ChangeList nextList, HeldFile nextFile)
    : former(std::move(formerFile)),
      list(std::move(nextList)),
      next(std::move(nextFile)),
      before(former->list),
      after(list),
      formerOf(matched(*former, before, after)),
      vanished(before.count(), true) {
    for (std::uint32_t b = 0; b < after.count(); ++b) {
        if (formerOf[b] == FileObjects::kNone) continue;
        vanished[formerOf[b]] = false;
        next.ids[b] = former->ids[formerOf[b]];
    }
    findRows();
    findOrder();
}

bool FileChange::empty() const {
    return rows.empty() && reordered.empty() && std::ranges::find(vanished, true) == vanished.end() &&
           std::ranges::find(formerOf, FileObjects::kNone) == formerOf.end();
}

bool FileChange::sameRef(ObjectId was, ObjectId is) const {
    const std::uint32_t a = before.placeOf(was), b = after.placeOf(is);
    if (b == FileObjects::kNone) return a == FileObjects::kNone && was == is;
    return a != FileObjects::kNone && formerOf[b] == a;
}

bool FileChange::sameValue(const FieldValue& was, const FieldValue& is) const {
    if (const auto* ref = std::get_if<ObjectId>(&was)) return sameRef(*ref, std::get<ObjectId>(is));
    if (const auto* refs = std::get_if<RefList>(&was))
        return std::ranges::equal(*refs, std::get<RefList>(is),
                                  [this](ObjectId a, ObjectId b) { return sameRef(a, b); });
    return was == is;
}

void FileChange::findRows() {
    for (std::uint32_t b = 0; b < after.count(); ++b) {
        const std::uint32_t a = formerOf[b];
        if (a == FileObjects::kNone) continue;
        for (const FieldEntry& field : after.type(b).fields) {
            FieldValue was = before.value(a, field), is = after.value(b, field);
            if (!sameValue(was, is)) rows.push_back({b, &field, std::move(was), std::move(is)});
        }
    }
}

void FileChange::findOrder() {
    std::vector<std::uint32_t>& index = siblingsBefore;
    index.resize(before.count());
    for (std::uint32_t a = 0; a <= before.count(); ++a) {
        std::uint32_t at = 0;
        if (a < before.count() && !before.isNode(a)) continue;
        for (const std::uint32_t child : before.children(a)) index[child] = at++;
    }
    for (std::uint32_t b = 0; b <= after.count(); ++b) {
        if (b < after.count() && (formerOf[b] == FileObjects::kNone || !after.isNode(b))) continue;
        std::int64_t last = -1;
        for (const std::uint32_t child : after.children(b)) {
            const std::uint32_t a = formerOf[child];
            if (a == FileObjects::kNone || std::int64_t{index[a]} <= last) {
                reordered.push_back(b);
                break;
            }
            last = index[a];
        }
    }
}

bool areSame(const FieldEntry& field, const FieldValue& a, const FieldValue& b) {
    if (a == b) return true;
    if (!field.quaternion) return false;
    constexpr double kRounding = 1e-12;
    const auto &x = std::get<Doubles>(a).values, &y = std::get<Doubles>(b).values;
    return std::ranges::equal(x, y, [](double p, double q) { return std::abs(p - q) <= kRounding; });
}

}  // namespace tessera
