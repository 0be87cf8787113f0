#include "common/scene/Clones.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "common/scene/FieldTable.h"
#include "common/scene/ServerNodes.h"

namespace tessera {

namespace {

/// One copy on its way.
class Copying {
public:
    Copying(const Aspect& aspect, const CloneOptions& options)
        : aspect_(aspect), options_(options), shareTypes_(options.shareTypes.begin(), options.shareTypes.end()) {
        for (const ObjectId id : options.shareObjects) {
            const Node* node = aspect.get<Node>(id);
            shareObjects_.insert(node ? node->core : id);
        }
    }

    [[nodiscard]] Expected<Clone> make(ObjectId top, ObjectId under) {
        if (!collectNodes(top) || (options_.deep && !collectOthers())) return tl::unexpected(tooLarge(top));
        ChangeListBuilder list;
        for (const ObjectId id : originals_) list.create(copyOf(id), aspect_.find(id).info().type);
        list.place(copyOf(top), under);
        // Parents before their children, siblings in their order.
        for (std::size_t i = 1; i < nodes_; ++i)
            list.place(copyOf(originals_[i]), copyOf(aspect_.get<Node>(originals_[i])->parent));
        for (const ObjectId id : originals_) setFields(list, id);
        if (!options_.name.empty()) list.set(copyOf(top), typeOf<Node>(), fieldId<&Node::name>, options_.name);
        Clone clone{list.take(), copyOf(top), originals_.size()};
        if (clone.list.changeCount() > options_.maxChanges) return tl::unexpected(tooLarge(top));
        return clone;
    }

private:
    [[nodiscard]] Error tooLarge(ObjectId top) const {
        return {ErrorCode::kLimit,
                fmt::format("a copy of {} would take more than {} changes at once; copy it part by part",
                            pathOf(aspect_, top), options_.maxChanges)};
    }
    /// False: that was one too many. Each object is a change at least, each node two.
    bool add(ObjectId id) {
        if (!copies_.try_emplace(id, kFirstPlaceholder + originals_.size()).second) return true;
        originals_.push_back(id);
        return originals_.size() + nodes_ <= options_.maxChanges;
    }
    bool collectNodes(ObjectId top) {
        if (!add(top)) return false;
        for (nodes_ = 0; nodes_ < originals_.size();) {
            const Node& node = *aspect_.get<Node>(originals_[nodes_++]);
            for (const ObjectId child : node.children)
                if (!aspect_.get<Node>(child)->ofServer && !add(child)) return false;
        }
        return true;
    }
    [[nodiscard]] bool isShared(ObjectId id, ObjectType type) const {
        return shareTypes_.contains(type) || shareObjects_.contains(id);
    }
    /// The cores of the nodes, then what stands beside the tree and is referred to from there, however far.
    bool collectOthers() {
        for (std::size_t i = 0; i < nodes_; ++i)
            if (const ObjectId core = aspect_.get<Node>(originals_[i])->core;
                core && !isShared(core, aspect_.find(core).info().type) && !add(core))
                return false;
        for (std::size_t i = nodes_; i < originals_.size(); ++i) {
            const Object object = aspect_.find(originals_[i]);
            bool fits = true;
            // What may refer to anything (key frames to what they move) takes part in none of it: that is no part of
            // the original by this.
            const auto follow = [&](ObjectId to) {
                if (!to || !fits) return;
                const TypeInfo& type = aspect_.find(to).info();
                const bool besideTheTree = !type.isCore && type.type != typeOf<Node>();
                if (besideTheTree && !isShared(to, type.type)) fits = add(to);
            };
            for (const FieldEntry& field : object.info().fields) {
                if (field.kind == FieldKind::kRef && !field.anyObject) follow(*field.in<ObjectId>(object.data()));
                if (field.kind == FieldKind::kRefs && !field.anyObject)
                    for (const ObjectId to : *field.in<RefList>(object.data())) follow(to);
            }
            if (!fits) return false;
        }
        return true;
    }
    [[nodiscard]] ObjectId copyOf(ObjectId id) const {
        const auto found = copies_.find(id);
        return found == copies_.end() ? id : ObjectId(found->second);
    }
    void setFields(ChangeListBuilder& list, ObjectId id) const {
        const Object object = aspect_.find(id);
        const TypeInfo& type = object.info();
        setAllFields(list, copyOf(id), object);
        // Again where it leads elsewhere: the last value counts.
        for (const FieldEntry& field : type.fields) {
            if (!field.holdsRefs()) continue;
            FieldValue value = field.load(object);
            if (auto* ref = std::get_if<ObjectId>(&value)) {
                if (const ObjectId copy = copyOf(*ref); copy != *ref) list.set(copyOf(id), type.type, field.id, copy);
            } else if (auto* refs = std::get_if<RefList>(&value)) {
                const RefList before = *refs;
                for (ObjectId& to : *refs) to = copyOf(to);
                if (*refs != before) list.set(copyOf(id), type.type, field.id, value);
            }
        }
    }

    const Aspect& aspect_;
    const CloneOptions& options_;
    std::unordered_set<ObjectType> shareTypes_;
    std::unordered_set<ObjectId> shareObjects_;
    std::vector<ObjectId> originals_;  ///< the first `nodes_` are nodes, each level of the tree after the one above it
    std::size_t nodes_ = 0;
    std::unordered_map<ObjectId, std::uint64_t> copies_;
};

bool standsBelow(const Aspect& aspect, ObjectId node, ObjectId top) {
    for (ObjectId at = node; at; at = aspect.get<Node>(at)->parent)
        if (at == top) return true;
    return false;
}

Expected<void> checkShareList(const Aspect& aspect, const CloneOptions& options) {
    if (!options.deep && !(options.shareTypes.empty() && options.shareObjects.empty()))
        return fail(ErrorCode::kUsage, "a copy that is not deep shares all cores; a share list is for a deep one");
    for (const ObjectType type : options.shareTypes) {
        if (!findType(type)) return fail(ErrorCode::kUsage, fmt::format("there is no type {} to share", type.value));
        if (type == typeOf<Node>()) return fail(ErrorCode::kUsage, "nodes cannot be shared: one node, one path");
    }
    for (const ObjectId id : options.shareObjects)
        if (!aspect.find(id))
            return fail(ErrorCode::kNotFound, fmt::format("there is no object #{} to share", id.value));
    return {};
}

}  // namespace

Expected<Clone> cloneList(const Aspect& aspect, ObjectId node, const CloneOptions& options) {
    const Node* original = aspect.get<Node>(node);
    if (original == nullptr) return fail(ErrorCode::kNotFound, fmt::format("there is no node #{}", node.value));
    if (node == kRootNode) return fail(ErrorCode::kRefused, "the root cannot be copied; copy what is below it");
    const ObjectId under = options.under ? options.under : original->parent;
    if (under && aspect.get<Node>(under) == nullptr)
        return fail(ErrorCode::kNotFound, fmt::format("there is no node #{}", under.value));
    if (under && standsBelow(aspect, under, node))
        return fail(ErrorCode::kRefused, fmt::format("{} cannot be copied into itself", pathOf(aspect, node)));
    for (const ObjectId one : {node, under})
        if (standsInServersOwn(aspect, one))
            return fail(ErrorCode::kRefused,
                        fmt::format("{}: the server makes it and takes it away; copy {}", pathOf(aspect, one),
                                    one == node ? "what it belongs to" : "to somewhere else"));
    if (const Expected<void> good = checkShareList(aspect, options); !good) return tl::unexpected(good.error());
    return Copying(aspect, options).make(node, under);
}

}  // namespace tessera
