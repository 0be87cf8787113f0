#include "server/sim/desk/SceneAnswers.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <unordered_set>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Animation.h"
#include "common/cores/Motion.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "common/scene/Search.h"

namespace tessera {

namespace {

/// Objects as the list that creates them and sets their fields, each once.
class ToldObjects {
public:
    explicit ToldObjects(const Aspect& scene) : scene_(scene) {}

    void add(ObjectId id) {
        const Object object = scene_.find(id);
        if (!object || !told_.insert(id).second) return;
        list_.create(id, object.info().type);
        setAllFields(list_, id, object);
        bytes_ += sizeOf(object);
    }
    void addNode(ObjectId id) {
        add(id);
        if (const Node* node = scene_.get<Node>(id); node && node->core) add(node->core);
    }
    /// About what `encoded` will be.
    [[nodiscard]] std::size_t bytes() const { return bytes_; }
    /// Of a node and its core, in that.
    [[nodiscard]] std::size_t bytesOf(ObjectId id) const {
        const Object object = scene_.find(id);
        const Node* node = object.as<Node>();
        return (object ? sizeOf(object) : 0) + (node && node->core ? sizeOf(scene_.find(node->core)) : 0);
    }
    [[nodiscard]] Bytes encoded() { return encodeChangeList(list_.take()); }

private:
    static std::size_t sizeOf(const Object& object) {
        std::size_t bytes = 16;
        for (const FieldEntry& field : object.info().fields) {
            bytes += 8 + std::size_t{8} * field.width;
            if (field.kind == FieldKind::kText) bytes += field.in<std::string>(object.data())->size();
            if (field.kind == FieldKind::kRefs) bytes += sizeof(ObjectId) * field.in<RefList>(object.data())->size();
            if (field.kind == FieldKind::kMatrix) bytes += sizeof(Matrix);
        }
        return bytes;
    }

    const Aspect& scene_;
    ChangeListBuilder list_;
    std::unordered_set<ObjectId> told_;
    std::size_t bytes_ = 0;
};

/// "#17" of any object; else the node at a path.
Expected<ObjectId> findNamed(const Aspect& scene, NodeFinder& nodes, std::string_view name) {
    std::uint64_t id = 0;
    const char* end = name.data() + name.size();
    if (name.starts_with('#') &&
        std::from_chars(name.data() + 1, end, id) == std::from_chars_result{end, std::errc()} &&
        scene.find(ObjectId(id)))
        return ObjectId(id);
    return nodes.find(name);
}

ObjectInfo infoOf(const Aspect& scene, ObjectId id) {
    const Object object = scene.find(id);
    ObjectInfo info{.id = id, .type = object.info().type};
    const Node* node = object.as<Node>();
    if (!node) {
        info.path = fmt::format("#{}", id.value);
        return info;
    }
    info.parent = node->parent;
    info.core = node->core;
    if (node->core) info.coreType = scene.find(node->core).info().type;
    info.children = node->children.size();
    for (ObjectId at = id; at && !info.movable; at = node->parent) {
        node = scene.get<Node>(at);
        if (node->core && scene.find(node->core).is<Transform>()) info.movable = at;
    }
    return info;
}

/// Of an Animation its last key (s), of a Motion too; nothing of others, and where no key is.
std::optional<double> playLength(const Aspect& scene, const Object& core) {
    std::optional<double> last;
    const auto reach = [&](const Blob& blob, std::size_t each) {
        const std::span<const double> numbers = blob.resident() ? blob.as<double>() : std::span<const double>();
        if (numbers.size() >= each) last = std::max(last.value_or(0), numbers[numbers.size() / each * each - each]);
    };
    if (const auto* animation = core.as<Animation>())
        for (const ObjectId channel : animation->channels)
            if (const auto* frames = scene.get<KeyFrames>(channel)) reach(frames->times, 1);
    if (const auto* motion = core.as<Motion>()) reach(motion->keys, 11);
    return last && std::isfinite(*last) ? last : std::nullopt;
}

/// A walk in the order of the document that can stop anywhere and go on later, in another state of the scene.
class TreeWalk {
public:
    TreeWalk(const Aspect& scene, std::uint32_t levels) : scene_(scene), levels_(levels) {}

    void beginAt(ObjectId top) { enter(top); }
    /// Behind the last of these, which were a way down once. Where the way is not what it was, from the first child of
    /// the last node that still is: rather twice than not at all.
    void goOnAfter(const std::vector<ObjectId>& way) {
        enter(way.front());
        for (std::size_t i = 1; i < way.size(); ++i) {
            const Node* next = scene_.get<Node>(way[i]);
            if (!next || next->parent != way[i - 1] || above_.size() < i) return;
            const ChildList& siblings = scene_.get<Node>(way[i - 1])->children;
            above_.back().at = siblings.from(siblings.indexOf(way[i]) + 1);
            last_ = way[i];
            enter(way[i]);
        }
    }

    /// None: that was the last.
    [[nodiscard]] ObjectId next() {
        while (!above_.empty() && above_.back().at == above_.back().end) above_.pop_back();
        if (above_.empty()) return {};
        last_ = *above_.back().at++;
        enter(last_);
        return last_;
    }
    /// For `goOnAfter`: the node told last and what is above it. Empty where nothing is left.
    [[nodiscard]] std::vector<ObjectId> way() {
        const bool more = std::ranges::any_of(above_, [](const Level& level) { return !(level.at == level.end); });
        if (!more) return {};
        std::vector<ObjectId> ids;
        for (const Level& level : above_) ids.push_back(level.parent);
        if (ids.back() != last_) ids.push_back(last_);
        return ids;
    }

private:
    struct Level {
        ObjectId parent;
        ChildList::Iterator at, end;
    };
    void enter(ObjectId id) {
        last_ = id;
        const ChildList& children = scene_.get<Node>(id)->children;
        if (above_.size() < levels_ && !children.empty()) above_.push_back({id, children.begin(), children.end()});
    }

    const Aspect& scene_;
    std::uint32_t levels_;
    std::vector<Level> above_;
    ObjectId last_;
};

PlaceValue placeOf(const Affine3d& world_T_node) {
    const Mat3d axes = world_T_node.linear();
    return {axes.col(0), axes.col(1), axes.col(2), world_T_node.translation()};
}

}  // namespace

Expected<answer::Objects> describe(const Aspect& scene, const ObjectsWish& wanted, const DescribeLimits& limits) {
    answer::Objects out;
    ToldObjects content(scene);
    std::optional<WorldTransforms> worlds;
    if (wanted.places) worlds.emplace(scene);
    std::vector<ObjectId> nodes;
    std::vector<std::size_t> places;
    NodeFinder finder(scene, limits.maxLooks);
    for (const std::string& name : wanted.names) {
        const Expected<ObjectId> id = findNamed(scene, finder, name);
        if (id) finder.lookAbove(*id, wanted.paths);
        if (finder.exhausted()) return fail(ErrorCode::kLimit, "too much stands beside these objects and above them");
        if (id && wanted.content && content.bytes() + content.bytesOf(*id) > limits.maxBytes)
            return fail(ErrorCode::kLimit,
                        fmt::format("their fields have more than {} MiB; ask for fewer", limits.maxBytes >> 20));
        out.objects.push_back(id ? infoOf(scene, *id) : ObjectInfo{.path = id.error().message});
        if (worlds) {
            const Affine3d world_T_node = worlds->of(id.value_or(ObjectId()));
            const bool reached = world_T_node.matrix().allFinite();
            out.places.push_back(placeOf(reached ? world_T_node : Affine3d::Identity()));
            if (!reached) {
                out.objects.back() = {.path = fmt::format("#{}: it has no place in the world; it would be beyond all "
                                                          "numbers, by the transforms above it",
                                                          id->value)};
                continue;
            }
        }
        if (!id) continue;
        if (wanted.paths && scene.get<Node>(*id)) {
            nodes.push_back(*id);
            places.push_back(out.objects.size() - 1);
        }
        if (wanted.content) content.addNode(*id);
    }
    std::vector<std::string> paths = pathsOf(scene, nodes);
    for (std::size_t i = 0; i < places.size(); ++i)
        if (paths[i].size() <= ApplicationLimits().maxTextBytes)
            out.objects[places[i]].path = std::move(paths[i]);
        else
            out.objects[places[i]].path = fmt::format("#{}", nodes[i].value);
    if (wanted.content) out.content = content.encoded();
    return out;
}

Expected<answer::TreePage> treePage(const Aspect& scene, const TreeWish& wanted, const PageLimits& limits) {
    if (!scene.get<Node>(wanted.node))
        return fail(ErrorCode::kNotFound, fmt::format("there is no node #{}", wanted.node.value));
    if (!wanted.after.empty() && wanted.after.front() != wanted.node)
        return fail(ErrorCode::kBadInput, "a page that goes on below another node than it began at");
    const std::unordered_set<ObjectId> cores(wanted.cores.begin(), wanted.cores.end());
    const bool all = cores.empty() && wanted.coreType == ObjectType();
    const auto isWanted = [&](const Node& node) {
        if (all) return true;
        if (!node.core) return false;
        return cores.contains(node.core) ||
               (wanted.coreType != ObjectType() && scene.find(node.core).info().type == wanted.coreType);
    };

    answer::TreePage page;
    ToldObjects content(scene);
    TreeWalk walk(scene, wanted.levels);
    bool tooLarge = false;
    const std::size_t most =
        wanted.pageSize == 0 ? limits.maxTold : std::min<std::size_t>(wanted.pageSize, limits.maxTold);
    const auto tell = [&](ObjectId id) {
        const Node& node = *scene.get<Node>(id);
        if (!isWanted(node)) return;
        tooLarge = tooLarge || content.bytesOf(id) > limits.maxObjectBytes;
        if (tooLarge) return;
        page.nodes.push_back({id, node.parent, node.children.size()});
        content.addNode(id);
        if (wanted.coreType == ObjectType() || !node.core) return;
        if (const std::optional<double> seconds = playLength(scene, scene.find(node.core)))
            page.lengths.push_back({node.core, *seconds});
    };
    if (wanted.after.empty()) {
        walk.beginAt(wanted.node);
        tell(wanted.node);
    } else {
        walk.goOnAfter(wanted.after);
    }
    for (std::size_t lookedAt = 1; lookedAt < limits.maxLookedAt; ++lookedAt) {
        if (page.nodes.size() >= most || content.bytes() >= limits.maxBytes || tooLarge) break;
        const ObjectId id = walk.next();
        if (!id) break;
        tell(id);
    }
    if (tooLarge) return fail(ErrorCode::kLimit, "an object on this page is large");
    page.next = walk.way();
    page.content = content.encoded();
    return page;
}

Expected<answer::FoundPage> foundPage(const Aspect& scene, const NodeSearch& wanted, const PageLimits& limits) {
    const Expected<PathPattern> pattern = PathPattern::parse(wanted.expression);
    if (!pattern) return tl::unexpected(pattern.error());
    SearchOptions options{.top = wanted.node, .coreType = wanted.coreType, .after = wanted.after};
    options.maxFound = std::clamp<std::size_t>(wanted.pageSize, 1, limits.maxTold);
    options.maxLookedAt = limits.maxLookedAt;
    options.maxWork = limits.maxWork;
    Expected<SearchPage> found = searchPage(scene, *pattern, options);
    if (!found) return tl::unexpected(found.error());

    answer::FoundPage page;
    page.next = std::move(found->next);
    page.lookedAt = found->lookedAt;
    std::vector<ObjectId> named;
    std::vector<std::size_t> places;
    std::unordered_set<ObjectId> parents;
    std::size_t siblings = 0;
    for (const ObjectId id : found->found) {
        page.nodes.push_back(infoOf(scene, id));
        page.nodes.back().path = fmt::format("#{}", id.value);
        std::vector<ObjectId> added;
        std::size_t more = 0;
        for (ObjectId at = scene.get<Node>(id)->parent; at && !parents.contains(at); at = scene.get<Node>(at)->parent) {
            more += scene.get<Node>(at)->children.size();
            added.push_back(at);
        }
        if (siblings + more > limits.maxSiblings) continue;
        siblings += more;
        parents.insert(added.begin(), added.end());
        named.push_back(id);
        places.push_back(page.nodes.size() - 1);
    }
    std::vector<std::string> paths = pathsOf(scene, named);
    for (std::size_t i = 0; i < places.size(); ++i)
        if (paths[i].size() <= ApplicationLimits().maxTextBytes) page.nodes[places[i]].path = std::move(paths[i]);
    return page;
}

}  // namespace tessera
