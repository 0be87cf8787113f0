/// Random histories of a tree with cameras, switches and motions, through the committer: every kind of edit, and the
/// way back.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "common/cores/Camera.h"
#include "common/cores/Motion.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/sim/commit/Committer.h"
#include "tests/property/Seeds.h"

namespace tessera::test {

/// Draws edits that mostly make sense; the committer refuses the rest.
class RandomTree {
public:
    Committer committer;

    explicit RandomTree(Random& random) : random_(random) {}
    [[nodiscard]] const Aspect& scene() const { return committer.scene(); }

    /// The list that was applied; null where it was refused.
    ChangeListPtr next() {
        if (!back_.empty() && oneIn(random_, 6)) {
            const ChangeListPtr list = std::make_shared<const ChangeList>(std::move(back_.back()));
            back_.pop_back();
            const Expected<Committer::Applied> applied = committer.applyInverse(list);
            return applied ? applied->list : nullptr;
        }
        made_.clear();
        ChangeListBuilder builder;
        for (std::size_t edits = oneIn(random_, 2) ? 1 : 1 + below(random_, 4); edits > 0; --edits) edit(builder);
        Expected<Committer::Applied> applied = committer.apply(builder.take(), Committer::Inverse::kMade);
        if (!applied) return nullptr;
        back_.push_back(std::move(applied->inverse));
        if (back_.size() > 6) back_.pop_front();
        return applied->list;
    }

private:
    ObjectId create(ChangeListBuilder& b, ObjectType type) {
        const ObjectId id{kFirstPlaceholder + made_.size()};
        b.create(id, type);
        made_.emplace_back(id, type);
        return id;
    }
    /// An older one or one of this list; none where there is none.
    ObjectId some(ObjectType type) {
        std::vector<ObjectId> all;
        for (const ObjectId id : scene().ids())
            if (typeOf(scene().find(id)) == type) all.push_back(id);
        for (const auto& [id, made] : made_)
            if (made == type) all.push_back(id);
        return all.empty() ? ObjectId() : all[below(random_, all.size())];
    }
    template <typename Core>
    ObjectId some() {
        return some(typeOf<Core>());
    }
    std::int64_t number(std::size_t n) { return static_cast<std::int64_t>(below(random_, n)); }
    double real() { return static_cast<double>(below(random_, 2000)) / 100 - 10; }
    std::string someName() { return std::array{"a", "b", "cam", "a[1]", "", "stage"}[below(random_, 6)]; }
    Blob someKeys() {
        std::vector<double> keys;
        for (std::size_t i = 0, count = 1 + below(random_, 4); i < count; ++i)
            for (const double v :
                 {static_cast<double>(i), real(), real(), 0.0, 1.0, 0.1 * real(), 0.0, 0.0, 1.0, 1.0, 1.0})
                keys.push_back(v);
        if (oneIn(random_, 4)) keys.pop_back();  // not sound
        return Blob::of(std::span<const double>(keys));
    }
    void setTransform(ChangeListBuilder& b, ObjectId id) {
        const ObjectType type = typeOf<Transform>();
        b.set(id, type, fieldId<&Transform::translation>, toValue(Vec3d(real(), real(), real())));
        if (oneIn(random_, 2))
            b.set(id, type, fieldId<&Transform::rotation>, toValue(Quatd(1, 0.1 * real(), 0.1 * real(), 0)));
        if (oneIn(random_, 4)) b.set(id, type, fieldId<&Transform::scale>, toValue(Vec3d(2, 2, 1 + 0.05 * real())));
    }
    void setMotion(ChangeListBuilder& b, ObjectId id) {
        const ObjectType type = typeOf<Motion>();
        if (oneIn(random_, 2)) b.set(id, type, fieldId<&Motion::target>, toValue(some<Transform>()));
        if (oneIn(random_, 2)) b.set(id, type, fieldId<&Motion::keys>, someKeys());
        if (oneIn(random_, 2)) b.set(id, type, fieldId<&Motion::playing>, number(2));
        if (oneIn(random_, 3)) b.set(id, type, fieldId<&Motion::mode>, number(3));
        if (oneIn(random_, 3)) b.set(id, type, fieldId<&Motion::time>, toValue(real()));
    }
    ObjectId newCore(ChangeListBuilder& b) {
        switch (below(random_, 8)) {
            case 0:
            case 1: {
                const ObjectId id = create(b, typeOf<Transform>());
                setTransform(b, id);
                return id;
            }
            case 2: {
                const ObjectId id = create(b, typeOf<Switch>());
                b.set(id, typeOf<Switch>(), fieldId<&Switch::choice>, number(6) - 3);
                b.set(id, typeOf<Switch>(), fieldId<&Switch::mask>, number(16));
                return id;
            }
            case 3:
            case 4:
                return create(b, typeOf<Camera>());
            case 5: {
                const ObjectId id = create(b, typeOf<Motion>());
                setMotion(b, id);
                return id;
            }
            case 6:
                return create(b, typeOf<Group>());
            default:
                return {};
        }
    }
    ObjectId someCore() {
        switch (below(random_, 4)) {
            case 0:
                return some<Camera>();
            case 1:
                return some<Switch>();
            case 2:
                return some<Transform>();
            default:
                return {};
        }
    }
    std::uint32_t someIndex() { return oneIn(random_, 2) ? Placement::kLast : static_cast<std::uint32_t>(number(2)); }

    void edit(ChangeListBuilder& b) {
        switch (below(random_, 16)) {
            case 0:
            case 1:
            case 2:
            case 3: {  // a new node
                const ObjectId parent = some<Node>();
                const ObjectId core = oneIn(random_, 4) ? someCore() : newCore(b);
                const ObjectId id = create(b, typeOf<Node>());
                b.set(id, typeOf<Node>(), fieldId<&Node::name>, someName());
                if (core) b.set(id, typeOf<Node>(), fieldId<&Node::core>, core);
                if (!oneIn(random_, 8)) b.place(id, parent, someIndex());
                break;
            }
            case 4:
            case 5:
            case 6: {  // elsewhere
                const ObjectId id = some<Node>();
                if (id == kRootNode) break;
                if (oneIn(random_, 4))
                    b.detach(id);
                else
                    b.place(id, some<Node>(), someIndex());
                break;
            }
            case 7:
            case 8: {                     // gone, with its core where that was its alone
                if (oneIn(random_, 6)) {  // comes and goes
                    b.destroy(create(b, oneIn(random_, 2) ? typeOf<Node>() : typeOf<Camera>()));
                    break;
                }
                const ObjectId id = some<Node>();
                const Node* node = scene().get<Node>(id);
                if (id == kRootNode || !node || !node->children.empty()) break;
                if (node->parent) b.detach(id);
                b.destroy(id);
                if (node->core && scene().useCount(node->core) == 1) b.destroy(node->core);
                break;
            }
            case 9:
                b.set(some<Node>(), typeOf<Node>(), fieldId<&Node::core>, oneIn(random_, 2) ? newCore(b) : someCore());
                break;
            case 10:
                b.set(some<Node>(), typeOf<Node>(), fieldId<&Node::name>, someName());
                break;
            case 11:
                if (const ObjectId id = some<Camera>()) {
                    b.set(id, typeOf<Camera>(), fieldId<&Camera::enabled>, number(2));
                    if (oneIn(random_, 2))
                        b.set(id, typeOf<Camera>(), fieldId<&Camera::worldUnitsPerMetre>, toValue(1.0 + number(5)));
                }
                break;
            case 12:
            case 13:
                if (const ObjectId id = some<Switch>())
                    b.set(id, typeOf<Switch>(), fieldId<&Switch::choice>, number(7) - 3);
                break;
            case 14:
                if (const ObjectId id = some<Motion>()) setMotion(b, id);
                break;
            default:
                if (const ObjectId id = some<Transform>()) setTransform(b, id);
        }
    }

    Random& random_;
    std::vector<std::pair<ObjectId, ObjectType>> made_;
    std::deque<ChangeList> back_;
};

}  // namespace tessera::test
