#include <deque>
#include <string>
#include <unordered_map>

#include "common/cores/Node.h"
#include "server/sim/reload/HeldFile.h"

namespace tessera {
namespace {

const FieldEntry& nodeField(FieldId id) {
    return *findField(*findType(typeOf<Node>()), id);
}
const FieldEntry& nameField() {
    static const FieldEntry& field = nodeField(fieldId<&Node::name>);
    return field;
}
const FieldEntry& coreField() {
    static const FieldEntry& field = nodeField(fieldId<&Node::core>);
    return field;
}

std::uint32_t coreOf(const FileObjects& file, std::uint32_t node) {
    return file.placeOf(std::get<ObjectId>(file.value(node, coreField())));
}

/// A node's name, and the type of its core.
std::string calledIn(const FileObjects& file, std::uint32_t node) {
    const std::uint32_t core = coreOf(file, node);
    std::string called = std::get<std::string>(file.value(node, nameField()));
    called.push_back('\0');
    return called + std::to_string(core == FileObjects::kNone ? 0 : file.type(core).type.value);
}

/// What a node and all below it say, its core with it. Each is worked out once.
class BelowHashes {
public:
    explicit BelowHashes(const FileObjects& file) : file_(file), known_(file.count()) {}
    std::uint64_t of(std::uint32_t node) {
        if (known_[node] != 0) return known_[node];
        std::vector<std::uint64_t> parts = {file_.contentHash(node)};
        if (const std::uint32_t core = coreOf(file_, node); core != FileObjects::kNone)
            parts.push_back(file_.contentHash(core));
        for (const std::uint32_t child : file_.children(node)) parts.push_back(of(child));
        return known_[node] = hash64(std::as_bytes(std::span(parts))) | 1;
    }

private:
    const FileObjects& file_;
    std::vector<std::uint64_t> known_;
};

class Matcher {
    static constexpr std::uint32_t kNone = FileObjects::kNone;

public:
    Matcher(const FileObjects& former, const FileObjects& next)
        : former_(former),
          next_(next),
          formerBelow_(former),
          nextBelow_(next),
          formerOf_(next.count(), kNone),
          taken_(former.count()) {}

    std::vector<std::uint32_t> run() {
        matchChildren(former_.children(former_.count()), next_.children(next_.count()));
        for (; !open_.empty(); open_.pop_front()) {
            const auto [a, b] = open_.front();
            if (next_.isNode(b)) matchChildren(former_.children(a), next_.children(b));
            matchReferred(a, b);
        }
        matchRest();
        return std::move(formerOf_);
    }

private:
    using Places = std::vector<std::uint32_t>;

    void pair(std::uint32_t a, std::uint32_t b) {
        formerOf_[b] = a;
        taken_[a] = true;
        open_.emplace_back(a, b);
    }

    void matchChildren(std::span<const std::uint32_t> former, std::span<const std::uint32_t> next) {
        std::unordered_map<std::string, Places> byName;
        for (const std::uint32_t a : former) byName[calledIn(former_, a)].push_back(a);
        std::unordered_map<std::string, Places> wanted;
        Places order;  // the first of each name: pairs are made in the order of the file
        for (const std::uint32_t b : next) {
            Places& same = wanted[calledIn(next_, b)];
            if (same.empty()) order.push_back(b);
            same.push_back(b);
        }
        for (const std::uint32_t first : order) {
            const std::string called = calledIn(next_, first);
            const auto known = byName.find(called);
            if (known == byName.end()) continue;
            const Places& those = wanted[called];
            if (known->second.size() == 1 && those.size() == 1)
                pair(known->second[0], those[0]);
            else
                matchAlike(
                    known->second, those, [&](std::uint32_t a) { return formerBelow_.of(a); },
                    [&](std::uint32_t b) { return nextBelow_.of(b); });
        }
    }

    /// Those that say the same first; the rest by their order.
    template <typename HashA, typename HashB>
    void matchAlike(const Places& former, const Places& next, HashA&& hashA, HashB&& hashB) {
        std::unordered_map<std::uint64_t, std::deque<std::uint32_t>> byHash;
        for (const std::uint32_t a : former) byHash[hashA(a)].push_back(a);
        for (const std::uint32_t b : next) {
            const auto same = byHash.find(hashB(b));
            if (same == byHash.end() || same->second.empty()) continue;
            pair(same->second.front(), b);
            same->second.pop_front();
        }
        std::size_t at = 0;
        for (const std::uint32_t b : next) {
            if (formerOf_[b] != kNone) continue;
            while (at < former.size() && taken_[former[at]]) ++at;
            if (at == former.size()) return;
            pair(former[at], b);
        }
    }

    [[nodiscard]] bool mayPair(std::uint32_t a, std::uint32_t b) const {
        return a != kNone && b != kNone && !taken_[a] && formerOf_[b] == kNone && !next_.isNode(b) &&
               former_.type(a).index == next_.type(b).index;
    }

    void matchReferred(std::uint32_t a, std::uint32_t b) {
        if (!next_.type(b).refers) return;
        for (const FieldEntry& field : next_.type(b).fields) {
            if (field.kind == FieldKind::kRef) {
                const std::uint32_t x = former_.placeOf(std::get<ObjectId>(former_.value(a, field)));
                const std::uint32_t y = next_.placeOf(std::get<ObjectId>(next_.value(b, field)));
                if (mayPair(x, y)) pair(x, y);
            } else if (field.kind == FieldKind::kRefs) {
                matchLists(placesIn(former_, a, field), placesIn(next_, b, field));
            }
        }
    }

    static Places placesIn(const FileObjects& file, std::uint32_t place, const FieldEntry& field) {
        Places places;
        const FieldValue value = file.value(place, field);
        for (const ObjectId id : std::get<RefList>(value))
            if (const std::uint32_t to = file.placeOf(id); to != kNone && !file.isNode(to)) places.push_back(to);
        return places;
    }

    void matchLists(const Places& former, const Places& next) {
        std::unordered_map<std::uint16_t, std::pair<Places, Places>> byType;
        for (const std::uint32_t a : former)
            if (!taken_[a]) byType[former_.type(a).index].first.push_back(a);
        for (const std::uint32_t b : next)
            if (formerOf_[b] == kNone) byType[next_.type(b).index].second.push_back(b);
        for (const std::uint32_t b : next) {
            const auto known = byType.find(next_.type(b).index);
            if (known == byType.end()) continue;
            matchCores(known->second.first, known->second.second);
            byType.erase(known);
        }
    }

    void matchCores(const Places& former, const Places& next) {
        matchAlike(
            former, next, [&](std::uint32_t a) { return former_.contentHash(a); },
            [&](std::uint32_t b) { return next_.contentHash(b); });
    }

    /// Materials, images and the like of what is new: those that say the same. (A core is its node's.)
    void matchRest() {
        std::unordered_map<std::uint64_t, std::deque<std::uint32_t>> byHash;
        for (std::uint32_t a = 0; a < former_.count(); ++a)
            if (!taken_[a] && isShared(former_.type(a))) byHash[former_.contentHash(a)].push_back(a);
        for (std::uint32_t b = 0; b < next_.count(); ++b) {
            if (formerOf_[b] != kNone || !isShared(next_.type(b))) continue;
            const auto same = byHash.find(next_.contentHash(b));
            if (same == byHash.end() || same->second.empty() || !mayPair(same->second.front(), b)) continue;
            pair(same->second.front(), b);
            same->second.pop_front();
        }
    }

    static bool isShared(const TypeInfo& type) { return !type.isCore && type.index != kTypeIndex<Node>; }

    const FileObjects &former_, &next_;
    BelowHashes formerBelow_, nextBelow_;
    Places formerOf_;
    std::vector<bool> taken_;
    std::deque<std::pair<std::uint32_t, std::uint32_t>> open_;
};

}  // namespace

std::vector<std::uint32_t> matchObjects(const FileObjects& former, const FileObjects& next) {
    return Matcher(former, next).run();
}

}  // namespace tessera
