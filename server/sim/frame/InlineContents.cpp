#include "server/sim/frame/InlineContents.h"

#include <algorithm>
#include <unordered_set>

#include <fmt/format.h>

#include "common/base/Utf8.h"
#include "common/cores/Inline.h"
#include "common/cores/ProxyGroup.h"
#include "common/scene/Edits.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

constexpr std::size_t kMostProblemBytes = 1000;

bool saysLoading(ObjectType type) {
    return type == typeOf<Inline>() || type == typeOf<ProxyGroup>();
}

template <typename T>
LoadWish readWish(const T& core) {
    return {.type = T::kType,
            .file = core.file,
            .load = core.load,
            .distance = core.distance,
            .wanted = core.wanted,
            .state = core.state,
            .box = {}};
}

template <typename T>
void writeState(ChangeListBuilder& edits, ObjectId core, std::int64_t state, const std::string& problem) {
    setField<&T::state>(edits, core, state);
    setField<&T::problem>(edits, core, problem);
}

bool isField(const FieldColumn& column, FieldId ofInline, FieldId ofProxy) {
    return (column.type == typeOf<Inline>() && column.field == ofInline) ||
           (column.type == typeOf<ProxyGroup>() && column.field == ofProxy);
}
bool saysState(const FieldColumn& column) {
    return isField(column, fieldId<&Inline::state>, fieldId<&ProxyGroup::state>);
}
bool saysProblem(const FieldColumn& column) {
    return isField(column, fieldId<&Inline::problem>, fieldId<&ProxyGroup::problem>);
}
bool saysFile(const FieldColumn& column) {
    return isField(column, fieldId<&Inline::file>, fieldId<&ProxyGroup::file>);
}
bool saysWanted(const FieldColumn& column) {
    return isField(column, fieldId<&Inline::wanted>, fieldId<&ProxyGroup::wanted>);
}
bool saysLoad(const FieldColumn& column) {
    return isField(column, fieldId<&Inline::load>, fieldId<&ProxyGroup::load>);
}

/// Puts nodes below others that have been elsewhere.
bool movesNodes(const ChangeList& list) {
    std::unordered_set<ObjectId> created;
    if (!list.placements.empty())
        for (const Creation& creation : list.creations) created.insert(creation.id);
    return std::ranges::any_of(list.placements, [&](const Placement& placement) {
        return placement.parent && !created.contains(placement.node);
    });
}
tl::unexpected<Error> nobodyWants(ObjectId core) {
    return fail(ErrorCode::kRefused, fmt::format("#{}: nobody wants what the file holds any more", core.value));
}
tl::unexpected<Error> othersCame() {
    return fail(ErrorCode::kRefused, "nodes have come below it while its file was read; remove them and set wanted");
}

const std::set<ObjectId> kNoBearers;

}  // namespace

std::optional<LoadWish> loadWishOf(const Object& core) {
    if (const auto* held = core.as<Inline>()) return readWish(*held);
    const auto* proxy = core.as<ProxyGroup>();
    if (!proxy) return std::nullopt;
    LoadWish wish = readWish(*proxy);
    wish.promises = true;
    wish.nodes = proxy->nodes;
    wish.triangles = proxy->triangles;
    if (proxy->lower != proxy->upper) wish.box = Box{proxy->lower, proxy->upper};
    return wish;
}

void setLoadState(ChangeListBuilder& edits, ObjectId core, ObjectType type, std::int64_t state,
                  std::string_view problem) {
    const std::string words(cutUtf8(problem, kMostProblemBytes));
    type == typeOf<Inline>() ? writeState<Inline>(edits, core, state, words)
                             : writeState<ProxyGroup>(edits, core, state, words);
}

const std::set<ObjectId>& InlineContents::bearersOf(ObjectId core) const {
    const auto known = bearers_.find(core);
    return known == bearers_.end() ? kNoBearers : known->second;
}

void InlineContents::update(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        bearers_.clear();
        coreOf_.clear();
        pending_.clear();
        there_.clear();
        ++moves_;
        const std::vector<ObjectId> ids = scene.ids();
        for (const ObjectId id : ids)
            if (saysLoading(typeOf(scene.find(id)))) noteCore(scene, id);
        if (bearers_.empty()) return;
        for (const ObjectId id : ids)
            if (scene.get<Node>(id)) noteNode(scene, id);
        return;
    }
    for (const Creation& creation : list->creations) {
        if (!saysLoading(creation.type)) continue;
        noteCore(scene, creation.id);
        if (there_.contains(creation.id)) ++moves_;
    }
    if (!there_.empty() && movesNodes(*list)) ++moves_;
    const bool nobody = bearers_.empty();
    for (const FieldColumn& column : list->columns) {
        if (saysLoading(column.type))
            for (const ObjectId id : column.ids) noteCore(scene, id);
        if (!nobody && column.type == typeOf<Node>() && column.field == fieldId<&Node::core>)
            for (const ObjectId id : column.ids) noteNode(scene, id);
    }
    if (nobody) return;
    for (const ObjectId id : list->destructions) {
        ++work_;
        pending_.erase(id);
        there_.erase(id);
        bearers_.erase(id);
        if (const auto bearer = coreOf_.find(id); bearer != coreOf_.end()) {
            if (const auto core = bearers_.find(bearer->second); core != bearers_.end()) core->second.erase(id);
            coreOf_.erase(bearer);
        }
    }
}

void InlineContents::noteCore(const Aspect& scene, ObjectId core) {
    ++work_;
    const std::optional<LoadWish> wish = loadWishOf(scene.find(core));
    if (!wish) return;  // destroyed by the same list
    bearers_.try_emplace(core);
    if (wish->state == LoadWords::kWaiting || wish->state == LoadWords::kLoading)
        pending_.insert(core);
    else
        pending_.erase(core);
    if (wish->state == LoadWords::kThere)
        there_.insert(core);
    else
        there_.erase(core);
}

void InlineContents::noteNode(const Aspect& scene, ObjectId id) {
    ++work_;
    const Node* node = scene.get<Node>(id);
    const ObjectId core = node ? node->core : ObjectId();
    const auto known = coreOf_.find(id);
    if (known != coreOf_.end()) {
        if (known->second == core) return;
        if (const auto old = bearers_.find(known->second); old != bearers_.end()) old->second.erase(id);
        coreOf_.erase(known);
    }
    const auto now = core ? bearers_.find(core) : bearers_.end();
    if (now == bearers_.end()) return;
    now->second.insert(id);
    coreOf_[id] = core;
}

Expected<void> InlineContents::checkPlaces(const Aspect& scene, const ChangeList& part, const IdRange& own) const {
    ObjectId last;
    for (const Placement& placement : part.placements) {
        if (!placement.parent || placement.parent == last || own.contains(placement.parent)) continue;
        last = placement.parent;
        const auto bearer = coreOf_.find(last);
        if (bearer == coreOf_.end()) continue;
        const std::optional<LoadWish> wish = loadWishOf(scene.find(bearer->second));
        if (!wish || wish->state != LoadWords::kLoading) return nobodyWants(bearer->second);
        const ChildList& children = scene.get<Node>(last)->children;
        if (!children.empty() && !(own.contains(children.front()) && own.contains(children.back())))
            return othersCame();
    }
    return {};
}

Expected<void> InlineContents::check(const Aspect& scene, const ChangeList& list, bool ofServer,
                                     const IdRange& own) const {
    if (ofServer && own.count > 0)
        if (Expected<void> wanted = checkPlaces(scene, list, own); !wanted) return wanted;
    for (const FieldColumn& column : list.columns) {
        if (!saysState(column) && !saysProblem(column)) continue;
        const auto* states = std::get_if<std::vector<std::int64_t>>(&column.values);
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const std::optional<LoadWish> wish = loadWishOf(scene.find(column.ids[row]));
            if (!wish) continue;  // new, or the scene refuses it in words
            if (!ofServer)
                return fail(
                    ErrorCode::kRefused,
                    fmt::format("#{}: the server alone says the state of an Inline or a ProxyGroup; set its wanted",
                                column.ids[row].value));
            if (!saysState(column) || !states || (*states)[row] != LoadWords::kThere) continue;
            if (wish->state != LoadWords::kLoading) return nobodyWants(column.ids[row]);
            for (const ObjectId bearer : bearersOf(column.ids[row]))
                for (const ObjectId child : scene.get<Node>(bearer)->children)
                    if (!own.contains(child)) return othersCame();
        }
    }
    return {};
}

std::vector<InlineContents::Change> InlineContents::changesBy(const Aspect& scene, const ChangeList& list) const {
    std::vector<Change> changes;
    if (bearers_.empty()) return changes;
    for (const FieldColumn& column : list.columns) {
        if (!saysFile(column) && !saysWanted(column) && !saysLoad(column)) continue;
        const auto* files = std::get_if<std::vector<std::string>>(&column.values);
        const auto* flags = std::get_if<std::vector<std::uint8_t>>(&column.values);
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const std::optional<LoadWish> wish = loadWishOf(scene.find(column.ids[row]));
            if (!wish) continue;
            auto change = std::ranges::find(changes, column.ids[row], &Change::core);
            if (change == changes.end()) change = changes.insert(changes.end(), Change{.core = column.ids[row]});
            if (saysFile(column) && files && (*files)[row] != wish->file) change->file = true;
            if (saysWanted(column) && flags && wish->wanted && (*flags)[row] == 0) change->takenBack = true;
        }
    }
    return changes;
}

std::vector<InlineContents::Consequence> InlineContents::following(const Aspect& scene,
                                                                   const std::vector<Change>& changes) const {
    std::vector<Consequence> all;
    for (const Change& change : changes) {
        const std::optional<LoadWish> wish = loadWishOf(scene.find(change.core));
        if (!wish) continue;
        const bool goes = change.file || (change.takenBack && wish->load != LoadWords::kAtOnce);
        const bool stops = change.file || (change.takenBack && wish->load == LoadWords::kByHand);
        ChangeList list;
        if (wish->state == LoadWords::kThere && goes) {
            std::vector<ObjectId> tops;
            for (const ObjectId bearer : bearersOf(change.core)) {
                const auto& children = scene.get<Node>(bearer)->children;
                tops.insert(tops.end(), children.begin(), children.end());
            }
            list = removalOf(scene, tops);
        } else if (wish->state == LoadWords::kWaiting || wish->state == LoadWords::kThere ||
                   (wish->state == LoadWords::kLoading && !stops)) {
            continue;
        }
        ChangeListBuilder state;
        setLoadState(state, change.core, wish->type, LoadWords::kWaiting);
        list.columns = state.take().columns;
        all.push_back({.core = change.core, .type = wish->type, .list = std::move(list)});
    }
    return all;
}

std::vector<InlineContents::Consequence> InlineContents::inTheWayOf(const Aspect& scene, const ChangeList& list) const {
    std::vector<Consequence> all;
    if (coreOf_.empty() || list.destructions.empty()) return all;
    std::unordered_set<ObjectId> going;
    for (const ObjectId id : list.destructions) {
        const auto bearer = coreOf_.find(id);
        if (bearer == coreOf_.end()) continue;
        const std::optional<LoadWish> wish = loadWishOf(scene.find(bearer->second));
        if (!wish || wish->state != LoadWords::kThere) continue;
        if (going.empty()) going.insert(list.destructions.begin(), list.destructions.end());
        std::vector<ObjectId> tops;
        for (const ObjectId child : scene.get<Node>(id)->children)
            if (!going.contains(child)) tops.push_back(child);
        if (tops.empty()) continue;
        ChangeList removal = removalOf(scene, tops);
        ChangeListBuilder state;
        setLoadState(state, bearer->second, wish->type, LoadWords::kWaiting);
        removal.columns = state.take().columns;
        all.push_back({.core = bearer->second, .type = wish->type, .list = std::move(removal)});
    }
    return all;
}

}  // namespace tessera
