#include "server/collision/objects/VisibleTree.h"

#include <algorithm>
#include <map>

#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "common/scene/ChildChoice.h"

namespace tessera {

namespace {

/// The one place that knows which types of cores mean what.
CoreKind kindOf(const Object& core) {
    if (!core) return CoreKind::kOther;
    if (core.info().pose) return CoreKind::kTransform;
    if (isDrawable(typeOf(core))) return CoreKind::kDrawable;
    if (core.is<Switch>() || core.is<DistanceLOD>()) return CoreKind::kSwitch;
    if (core.is<Interest>()) return CoreKind::kInterest;
    if (core.is<CollisionObject>()) return CoreKind::kObject;
    if (core.is<Environment>()) return CoreKind::kEnvironment;
    return CoreKind::kOther;
}

/// The children that a node shows of which it does not show all, in their order. What users see of levels of detail is
/// no matter.
std::optional<std::vector<ObjectId>> chosen(const Aspect& aspect, const Node& node) {
    const auto seen = seenChildren(node.core ? aspect.find(node.core) : Object(), node.children.size());
    if (!seen) return std::nullopt;
    std::vector<ObjectId> children;
    for (const std::size_t index : *seen) children.push_back(node.children[index]);
    return children;
}

bool isAmong(const std::vector<ObjectId>& some, ObjectId node) {
    return std::ranges::find(some, node) != some.end();  // 63 at most
}

/// Where these children stand among the others, ascending.
std::vector<std::pair<std::size_t, ObjectId>> positionsOf(const Node& parent, std::span<const ObjectId> children) {
    std::vector<std::pair<std::size_t, ObjectId>> found;
    for (const ObjectId child : children)
        if (parent.children.contains(child)) found.emplace_back(parent.children.indexOf(child), child);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

}  // namespace

void VisibleTree::begin(const Aspect& aspect) {
    places_.clear();
    links_.clear();
    free_.clear();
    placeOf_.reset(0);
    order_.clear();
    bearers_.clear();
    freeBearers_.clear();
    bearersOf_.reset(0);
    interests_.clear();
    environments_.clear();
    hidden_.reset(0);
    cutOuts_.clear();
    changes_ = {};
    watchedChanged_ = false;
    (void)show(aspect, kRootNode, kNone, kNone);
    changes_.placed.push_back(placeOf_.find(kRootNode));
}

void VisibleTree::follow(const Aspect& aspect, std::span<const Placement> placements, std::span<const ObjectId> recored,
                         std::span<const ObjectId> switches) {
    std::vector<ObjectId> moved;
    for (const Placement& placement : placements) moved.push_back(placement.node);
    std::sort(moved.begin(), moved.end());
    moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
    std::vector<std::uint32_t> choosing;  // switches that may show another child
    for (const ObjectId node : moved) {
        if (const std::uint32_t place = find(node); place != kNone) {
            const std::uint32_t parent = places_[place].parent;
            if (parent != kNone && links_[parent].chooses) choosing.push_back(parent);
            cutOut(place);
        } else if (const std::uint32_t hider = hidden_.find(node); hider != kNone) {
            choosing.push_back(hider);
            hidden_.erase(node);
        }
    }
    for (const ObjectId node : recored) {
        const std::uint32_t place = find(node);
        if (place == kNone) continue;
        const bool chose = places_[place].kind == CoreKind::kSwitch;
        if (links_[place].chooses) forgetHidden(aspect, place);
        unbear(place);
        const Node* now = aspect.get<Node>(node);
        bear(aspect, place, now ? now->core : ObjectId{});
        changes_.recored.push_back(place);
        if (chose || places_[place].kind == CoreKind::kSwitch) choosing.push_back(place);
    }
    for (const ObjectId core : switches)
        if (const std::uint32_t number = bearersOf(core); number != kNone)
            for (std::uint32_t place = bearers_[number].first; place != kNone; place = nextBearer(place))
                choosing.push_back(place);

    std::map<std::uint32_t, std::vector<ObjectId>> joining;  // by the parent's place
    for (const ObjectId node : moved) {
        const Node* now = aspect.get<Node>(node);
        const std::uint32_t parent = now && now->parent ? find(now->parent) : kNone;
        if (parent == kNone) continue;
        if (links_[parent].chooses) {
            hidden_.insert(node, parent);
            choosing.push_back(parent);
        } else {
            joining[parent].push_back(node);
        }
    }
    std::sort(choosing.begin(), choosing.end());
    choosing.erase(std::unique(choosing.begin(), choosing.end()), choosing.end());
    for (const std::uint32_t place : choosing) choose(aspect, place);
    for (const auto& [parent, nodes] : joining) attach(aspect, parent, nodes);
    drop(aspect);
}

/// Nodes that stand under a visible one now, which shows all its children.
void VisibleTree::attach(const Aspect& aspect, std::uint32_t parent, std::span<const ObjectId> nodes) {
    const Node* above = aspect.get<Node>(places_[parent].node);
    if (!above || links_[parent].chooses) return;
    for (const auto& [index, node] : positionsOf(*above, nodes)) {
        if (const std::uint32_t known = find(node); known != kNone && !links_[known].cutOut) continue;
        std::uint32_t after = DocumentOrder::open(parent);
        for (std::size_t i = index; i > 0; --i) {  // the one before stands already
            const std::uint32_t sibling = find(above->children[i - 1]);
            if (sibling == kNone || links_[sibling].cutOut) continue;
            after = DocumentOrder::close(sibling);
            break;
        }
        (void)show(aspect, node, parent, after);
        changes_.placed.push_back(find(node));
    }
}

/// Shows the children that a core lets show, and hides the others.
void VisibleTree::choose(const Aspect& aspect, std::uint32_t place) {
    const Node* node = aspect.get<Node>(places_[place].node);
    if (!node) return;
    const std::optional<std::vector<ObjectId>> only = chosen(aspect, *node);
    const bool was = links_[place].chooses;
    if (only) {
        std::vector<std::uint32_t> shown;
        for (std::uint32_t at = order_.next(DocumentOrder::open(place)); at != DocumentOrder::close(place);
             at = order_.next(DocumentOrder::close(DocumentOrder::placeOf(at))))
            shown.push_back(DocumentOrder::placeOf(at));
        for (const std::uint32_t child : shown) {
            if (isAmong(*only, places_[child].node)) continue;
            const Node* gone = aspect.get<Node>(places_[child].node);
            if (gone && gone->parent == places_[place].node) hidden_.insert(places_[child].node, place);
            cutOut(child);
        }
        if (!was)
            for (const ObjectId child : node->children)
                if (!isAmong(*only, child)) hidden_.insert(child, place);
    } else if (was) {
        forgetHidden(aspect, place);
    }
    links_[place].chooses = only.has_value();
    std::uint32_t after = DocumentOrder::open(place);
    const auto showChild = [&](ObjectId child) {
        const std::uint32_t known = find(child);
        const bool stands = known != kNone && !links_[known].cutOut;
        after = show(aspect, child, place, after);
        if (!stands) changes_.placed.push_back(find(child));
    };
    if (only)
        for (const ObjectId child : *only) showChild(child);
    else
        for (const ObjectId child : node->children) showChild(child);
}

void VisibleTree::forgetHidden(const Aspect& aspect, std::uint32_t place) {
    links_[place].chooses = false;
    const Node* node = aspect.get<Node>(places_[place].node);
    if (!node) return;
    for (const ObjectId child : node->children)
        if (hidden_.find(child) == place) hidden_.erase(child);
}

/// A node and what it shows, where it is not there yet. Returns its last bracket.
std::uint32_t VisibleTree::show(const Aspect& aspect, ObjectId nodeId, std::uint32_t parent, std::uint32_t after) {
    if (const std::uint32_t known = find(nodeId); known != kNone) {
        if (links_[known].cutOut) putBack(known, parent, after);
        return DocumentOrder::close(known);
    }
    const std::uint32_t place = take();
    const Node& node = *aspect.get<Node>(nodeId);
    places_[place].node = nodeId;
    places_[place].parent = parent;
    placeOf_.insert(nodeId, place);
    hidden_.erase(nodeId);
    order_.insert(place, after);
    bear(aspect, place, node.core);
    const std::optional<std::vector<ObjectId>> only = chosen(aspect, node);
    std::uint32_t last = DocumentOrder::open(place);
    if (!only) {
        for (const ObjectId child : node.children) last = show(aspect, child, place, last);
        return DocumentOrder::close(place);
    }
    links_[place].chooses = true;
    for (const ObjectId child : node.children)
        if (!isAmong(*only, child)) hidden_.insert(child, place);
    for (const ObjectId child : *only) last = show(aspect, child, place, last);
    return DocumentOrder::close(place);
}

std::uint32_t VisibleTree::take() {
    if (free_.empty()) {
        places_.growTo(places_.size() + 1);
        links_.emplace_back();
        return static_cast<std::uint32_t>(places_.size() - 1);
    }
    const std::uint32_t place = free_.back();
    free_.pop_back();
    return place;
}

void VisibleTree::cutOut(std::uint32_t place) {
    if (links_[place].cutOut) return;
    countAbove(place, -static_cast<std::int32_t>(places_[place].parts),
               -static_cast<std::int32_t>(places_[place].objects));
    order_.cut(place);
    places_[place].parent = kNone;
    links_[place].cutOut = true;
    cutOuts_.push_back(place);
}

void VisibleTree::putBack(std::uint32_t place, std::uint32_t parent, std::uint32_t after) {
    order_.paste(place, after);
    places_[place].parent = parent;
    links_[place].cutOut = false;
    countAbove(place, static_cast<std::int32_t>(places_[place].parts),
               static_cast<std::int32_t>(places_[place].objects));
}

/// What was taken out and has not come back is gone.
void VisibleTree::drop(const Aspect& aspect) {
    for (const std::uint32_t top : cutOuts_) {
        if (!links_[top].cutOut || !places_[top].node) continue;
        walk(top, [&](std::uint32_t place) {
            changes_.gone.push_back(place);
            return true;
        });
    }
    cutOuts_.clear();
    for (const std::uint32_t place : changes_.gone) {
        if (links_[place].chooses) forgetHidden(aspect, place);
        unbear(place);
        placeOf_.erase(places_[place].node);
    }
    std::erase_if(changes_.placed, [&](std::uint32_t place) { return find(places_[place].node) != place; });
    std::erase_if(changes_.recored, [&](std::uint32_t place) { return find(places_[place].node) != place; });
}

void VisibleTree::recycle() {
    for (const std::uint32_t place : changes_.gone) {
        places_[place] = {};
        links_[place] = {};
        free_.push_back(place);
    }
    changes_ = {};
}

void VisibleTree::bear(const Aspect& aspect, std::uint32_t place, ObjectId core) {
    Place& it = places_[place];
    const Object object = core ? aspect.find(core) : Object();
    it.core = core;
    it.kind = kindOf(object);
    it.transform = it.kind == CoreKind::kTransform ? core : ObjectId{};
    if (it.kind == CoreKind::kTransform) {
        const NodePose pose = object.info().pose(object.data());
        it.local = pose.matrix;
        it.absolute = pose.absolute;
        it.movable = object.is<Transform>();
    } else {
        it.local = Affine3d::Identity();
        it.absolute = it.movable = false;
    }
    if (it.kind == CoreKind::kOther) return;
    std::uint32_t number = bearersOf_.find(core);
    if (number == kNone) {
        if (freeBearers_.empty()) {
            number = static_cast<std::uint32_t>(bearers_.size());
            bearers_.emplace_back();
        } else {
            number = freeBearers_.back();
            freeBearers_.pop_back();
        }
        bearersOf_.insert(core, number);
        bearers_[number] = {core, it.kind, kNone, 0};
        if (it.kind == CoreKind::kInterest) interests_.insert(core);
        if (it.kind == CoreKind::kEnvironment) environments_.insert(core);
    }
    Bearers& all = bearers_[number];
    links_[place].previous = kNone;
    links_[place].next = all.first;
    if (all.first != kNone) links_[all.first].previous = place;
    all.first = place;
    ++all.count;
    if (it.kind == CoreKind::kTransform && all.count == 2) changes_.shared.push_back(core);
    if (it.kind == CoreKind::kObject) changes_.objects.push_back(core);
    changes_.interests = changes_.interests || it.kind == CoreKind::kInterest;
    changes_.environments = changes_.environments || it.kind == CoreKind::kEnvironment;
}

void VisibleTree::unbear(std::uint32_t place) {
    Place& it = places_[place];
    if (it.kind == CoreKind::kOther) return;
    const std::uint32_t number = bearersOf_.find(it.core);
    Bearers& all = bearers_[number];
    Links& mine = links_[place];
    (mine.previous == kNone ? all.first : links_[mine.previous].next) = mine.next;
    if (mine.next != kNone) links_[mine.next].previous = mine.previous;
    mine.previous = mine.next = kNone;
    --all.count;
    if (it.kind == CoreKind::kTransform && all.count == 1) changes_.shared.push_back(it.core);
    if (it.kind == CoreKind::kObject) changes_.objects.push_back(it.core);
    changes_.interests = changes_.interests || it.kind == CoreKind::kInterest;
    changes_.environments = changes_.environments || it.kind == CoreKind::kEnvironment;
    if (all.count > 0) return;
    if (it.kind == CoreKind::kInterest) interests_.erase(it.core);
    if (it.kind == CoreKind::kEnvironment) environments_.erase(it.core);
    bearersOf_.erase(it.core);
    all = {};
    freeBearers_.push_back(number);
}

std::vector<std::uint32_t> VisibleTree::sortedBearers(std::uint32_t number) const {
    std::vector<std::uint32_t> out;
    for (std::uint32_t place = bearers_[number].first; place != kNone; place = nextBearer(place)) out.push_back(place);
    std::sort(out.begin(), out.end(), [&](std::uint32_t a, std::uint32_t b) { return order_.before(a, b); });
    return out;
}

std::uint32_t VisibleTree::firstBearer(std::uint32_t number) const {
    std::uint32_t first = bearers_[number].first;
    for (std::uint32_t place = first; place != kNone; place = nextBearer(place))
        if (order_.before(place, first)) first = place;
    return first;
}

void VisibleTree::sort(std::vector<std::uint32_t>& places) const {
    const auto before = [&](std::uint32_t a, std::uint32_t b) { return order_.before(a, b); };
    if (!std::is_sorted(places.begin(), places.end(), before)) std::sort(places.begin(), places.end(), before);
    places.erase(std::unique(places.begin(), places.end()), places.end());
}

void VisibleTree::topmost(std::vector<std::uint32_t>& places) const {
    sort(places);
    std::size_t kept = 0;
    for (const std::uint32_t place : places)
        if (kept == 0 || !order_.holds(places[kept - 1], place)) places[kept++] = place;
    places.resize(kept);
}

void VisibleTree::count(std::uint32_t place, std::int32_t parts, std::int32_t objects) {
    for (std::uint32_t at = place; at != kNone; at = places_[at].parent) {
        Place& it = places_[at];
        it.parts += static_cast<std::uint32_t>(parts);
        const bool any = it.objects != 0;
        it.objects += static_cast<std::uint32_t>(objects);
        if (links_[at].watched && any != (it.objects != 0)) watchedChanged_ = true;
    }
}

void VisibleTree::countAbove(std::uint32_t place, std::int32_t parts, std::int32_t objects) {
    if ((parts != 0 || objects != 0) && places_[place].parent != kNone) count(places_[place].parent, parts, objects);
}

}  // namespace tessera
