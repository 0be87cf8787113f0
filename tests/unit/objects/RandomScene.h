/// Random histories: every kind of edit, and the way back.
#pragma once

#include <random>
#include <vector>

#include "common/cores/Environment.h"
#include "tests/unit/objects/ObjectScene.h"

namespace tessera {

/// Draws edits that mostly make sense; the aspect refuses the rest.
class RandomScene {
public:
    Aspect aspect;

    explicit RandomScene(std::uint32_t seed) : random_(seed) {
        Soup bad = boxSoup(Vec3d::Ones());
        bad.indices[5] = 1000;
        Soup broken = boxSoup(Vec3d::Ones());
        broken.positions[3] = std::numeric_limits<float>::quiet_NaN();
        soups_ = {boxSoup(Vec3d::Ones()),
                  boxSoup(Vec3d(2, 1, 3)),
                  boxSoup(Vec3d(0.1, 5, 0.1)),
                  boxSoup(Vec3d(4, 4, 0.5)),
                  sheetSoup(),
                  bad,
                  broken,
                  Soup{}};
        begin();
    }

    /// The next list, applied. Null where the scene refused it.
    std::shared_ptr<const ChangeList> next() {
        ChangeList list;
        if (!back_.empty() && below(6) == 0) {
            list = std::move(back_.back());
            back_.pop_back();
        } else {
            ChangeListBuilder builder;
            next_ = aspect.nextFreeId();
            made_.clear();
            for (std::uint32_t edits = below(2) == 0 ? 1 : 1 + below(4); edits > 0; --edits) edit(builder);
            list = builder.take();
        }
        Expected<ChangeList> inverse = aspect.applyWithInverse(list);
        if (!inverse) return nullptr;
        back_.push_back(std::move(*inverse));
        if (back_.size() > 6) back_.erase(back_.begin());
        return std::make_shared<const ChangeList>(std::move(list));
    }

    [[nodiscard]] std::uint32_t below(std::uint32_t n) { return random_() % n; }
    [[nodiscard]] double between(double low, double high) {
        return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0);
    }
    [[nodiscard]] Transform someTransform() {
        Transform t;
        if (below(8) == 0) return t;
        t.translation = Vec3d(between(-5, 5), between(-5, 5), between(-5, 5));
        if (below(2) == 0) t.rotation = Quatd(between(-1, 1), between(-1, 1), between(-1, 1), between(0.1, 1));
        switch (below(6)) {
            case 0:
                t.scale = Vec3d::Constant(between(0.5, 2));
                break;
            case 1:
                t.scale = Vec3d(between(0.5, 2), between(0.5, 2), between(0.5, 2));
                break;
            case 2:
                t.scale = Vec3d(-1, 1, below(2) == 0 ? 1 : -1);
                break;
            case 3:
                t.scale = below(4) == 0 ? Vec3d(0, 1, 1) : Vec3d(Vec3d::Ones());
                break;
            default:
                break;
        }
        return t;
    }
    /// Some object of a type, an older one or one of this list; none where there is none.
    [[nodiscard]] ObjectId some(ObjectType type) {
        std::vector<ObjectId> all;
        for (const ObjectId id : aspect.ids())
            if (typeOf(aspect.find(id)) == type) all.push_back(id);
        for (const auto& [id, made] : made_)
            if (made == type) all.push_back(id);
        return all.empty() ? ObjectId{} : all[below(static_cast<std::uint32_t>(all.size()))];
    }

private:
    /// Something for the edits to work on: things, some of them objects, and interests in everything.
    void begin() {
        ChangeListBuilder b;
        next_ = aspect.nextFreeId();
        std::vector<ObjectId> nodes{kRootNode};
        const auto place = [&](ObjectId parent, ObjectId core) {
            const ObjectId id = create(b, typeOf<Node>());
            b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
            b.place(id, parent);
            return id;
        };
        for (int i = 0; i < 9; ++i) {
            const ObjectId transform = create(b, typeOf<Transform>()), geometry = create(b, typeOf<Geometry>());
            setTransform(b, transform);
            setArrays(b, geometry, true);
            nodes.push_back(place(nodes[below(static_cast<std::uint32_t>(nodes.size()))], transform));
            place(nodes.back(), geometry);
        }
        for (int i = 0; i < 5; ++i) {
            const ObjectId object = create(b, typeOf<CollisionObject>());
            b.set(object, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(nodes[1 + below(9)]));
            if (i == 0)
                b.set(object, typeOf<CollisionObject>(), fieldId<&CollisionObject::kind>, CollisionObject::kDeforming);
            if (i > 1) b.set(object, typeOf<CollisionObject>(), fieldId<&CollisionObject::mass>, toValue(1.0 + i));
            place(kRootNode, object);
        }
        for (int i = 0; i < 3; ++i) {
            const ObjectId interest = create(b, typeOf<Interest>());
            b.set(interest, typeOf<Interest>(), fieldId<&Interest::object>,
                  toValue(i == 2 ? nodes[1 + below(9)] : kRootNode));
            place(kRootNode, interest);
        }
        const Expected<void> applied = aspect.apply(b.take());
        EXPECT_TRUE(applied) << applied.error().message;
    }

    ObjectId create(ChangeListBuilder& b, ObjectType type) {
        const ObjectId id{next_++};
        b.create(id, type);
        made_.emplace_back(id, type);
        return id;
    }
    ObjectId someNode() { return some(typeOf<Node>()); }
    ObjectId someNodeOrNone() { return below(4) == 0 ? ObjectId{} : someNode(); }

    void setTransform(ChangeListBuilder& b, ObjectId id) {
        const Transform t = someTransform();
        b.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(t.translation));
        b.set(id, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(t.rotation));
        b.set(id, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(t.scale));
    }
    void setArrays(ChangeListBuilder& b, ObjectId id, bool indicesToo) {
        const Soup& soup = soups_[below(below(3) == 0 ? static_cast<std::uint32_t>(soups_.size()) : 4)];
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, soup.positionBlob());
        if (!indicesToo) return;
        const bool points = below(5) == 0;
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>, points ? Blob() : soup.indexBlob());
        setPrimitive(b, id, points);
    }
    void setPrimitive(ChangeListBuilder& b, ObjectId id, bool points) {
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::primitive>,
              toValue(points ? Geometry::kPoints : Geometry::kTriangles));
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::pointRadius>,
              toValue(below(3) == 0 ? 0.0 : between(0.01, 0.3)));
    }
    void setInterest(ChangeListBuilder& b, ObjectId id) {
        const ObjectType type = typeOf<Interest>();
        const auto number = [&](std::uint32_t n) { return toValue(std::int64_t{below(n)}); };
        const auto mask = [&] { return toValue(below(2) == 0 ? std::int64_t{-1} : std::int64_t{below(8)}); };
        if (below(2) == 0) b.set(id, type, fieldId<&Interest::object>, toValue(someNodeOrNone()));
        if (below(3) == 0) b.set(id, type, fieldId<&Interest::against>, toValue(someNodeOrNone()));
        if (below(3) == 0) b.set(id, type, fieldId<&Interest::response>, number(6));
        if (below(4) == 0) b.set(id, type, fieldId<&Interest::enabled>, below(4) != 0);
        if (below(3) == 0) b.set(id, type, fieldId<&Interest::mode>, number(6));
        if (below(3) == 0) b.set(id, type, fieldId<&Interest::detail>, toValue(std::int64_t{below(6)} - 1));
        if (below(4) == 0) b.set(id, type, fieldId<&Interest::objectLayers>, mask());
        if (below(4) == 0) b.set(id, type, fieldId<&Interest::againstLayers>, mask());
        if (below(3) == 0) b.set(id, type, fieldId<&Interest::threshold>, toValue(between(0, 3)));
        if (below(4) == 0) b.set(id, type, fieldId<&Interest::show>, number(8));
        if (below(4) == 0) b.set(id, type, fieldId<&Interest::patience>, number(30));
    }
    void setObject(ChangeListBuilder& b, ObjectId id) {
        const ObjectType type = typeOf<CollisionObject>();
        const auto number = [&](std::uint32_t n) { return toValue(std::int64_t{below(n)}); };
        if (below(3) == 0) b.set(id, type, fieldId<&CollisionObject::node>, toValue(someNodeOrNone()));
        if (below(4) == 0) b.set(id, type, fieldId<&CollisionObject::kind>, number(3));
        if (below(4) == 0) b.set(id, type, fieldId<&CollisionObject::division>, number(3));
        if (below(4) == 0) b.set(id, type, fieldId<&CollisionObject::shape>, number(2));
        if (below(4) == 0) b.set(id, type, fieldId<&CollisionObject::layers>, number(8));
        if (below(4) == 0) b.set(id, type, fieldId<&CollisionObject::level>, number(4));
        if (below(2) == 0)
            b.set(id, type, fieldId<&CollisionObject::mass>, toValue(below(3) == 0 ? 0.0 : between(1, 9)));
        if (below(3) == 0) b.set(id, type, fieldId<&CollisionObject::friction>, toValue(between(0, 1)));
        if (below(3) == 0) b.set(id, type, fieldId<&CollisionObject::restitution>, toValue(between(0, 1)));
        if (below(3) == 0) b.set(id, type, fieldId<&CollisionObject::velocity>, toValue(Vec3d(between(-1, 1), 2, 3)));
        if (below(3) == 0) b.set(id, type, fieldId<&CollisionObject::spin>, toValue(Vec3d(1, between(-1, 1), 3)));
    }
    ObjectId newCore(ChangeListBuilder& b) {
        switch (below(12)) {
            case 0:
            case 1:
            case 2: {
                const ObjectId id = create(b, typeOf<Transform>());
                setTransform(b, id);
                return id;
            }
            case 3:
            case 4:
            case 5: {
                const ObjectId id = create(b, typeOf<Geometry>());
                setArrays(b, id, true);
                return id;
            }
            case 6: {
                const ObjectId id = create(b, typeOf<Switch>());
                b.set(id, typeOf<Switch>(), fieldId<&Switch::choice>, toValue(std::int64_t{below(5)} - 3));
                b.set(id, typeOf<Switch>(), fieldId<&Switch::mask>, toValue(std::int64_t{below(8)}));
                return id;
            }
            case 7:
            case 8: {
                const ObjectId id = create(b, typeOf<Interest>());
                b.set(id, typeOf<Interest>(), fieldId<&Interest::object>, toValue(someNode()));
                return id;
            }
            case 9:
            case 10: {
                const ObjectId id = create(b, typeOf<CollisionObject>());
                b.set(id, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(someNode()));
                setObject(b, id);
                return id;
            }
            default: {
                const ObjectId id = create(b, typeOf<Environment>());
                b.set(id, typeOf<Environment>(), fieldId<&Environment::gravity>, toValue(Vec3d(0, between(-9, 0), 0)));
                return id;
            }
        }
    }
    /// An older core, so that nodes share.
    ObjectId someCore() {
        switch (below(4)) {
            case 0:
                return some(typeOf<Transform>());
            case 1:
                return some(typeOf<Interest>());
            case 2:
                return some(typeOf<CollisionObject>());
            default:
                return some(typeOf<Geometry>());
        }
    }
    void edit(ChangeListBuilder& b) {
        switch (below(22)) {
            case 0:
            case 1:
            case 2:
            case 3:
            case 4: {  // a new node
                const ObjectId parent = someNode();
                const ObjectId core = below(3) == 0 ? someCore() : newCore(b);
                const ObjectId id = create(b, typeOf<Node>());
                if (core) b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
                b.place(id, parent, below(2) == 0 ? Placement::kLast : 0);
                break;
            }
            case 5:
            case 6: {  // elsewhere
                const ObjectId id = someNode();
                if (id == kRootNode) break;
                if (below(4) == 0)
                    b.detach(id);
                else
                    b.place(id, someNode(), below(2) == 0 ? Placement::kLast : 0);
                break;
            }
            case 7: {  // gone
                const ObjectId id = someNode();
                if (id == kRootNode || !aspect.find(id) || aspect.useCount(id) > 0) break;
                if (!aspect.get<Node>(id)->children.empty()) break;
                const ObjectId core = aspect.get<Node>(id)->core;
                b.detach(id);
                b.destroy(id);
                if (core && aspect.useCount(core) == 1) b.destroy(core);
                break;
            }
            case 8: {
                const ObjectId id = someNode();
                if (id == kRootNode && below(4) != 0) break;
                b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(below(5) == 0 ? ObjectId{} : someCore()));
                break;
            }
            case 9: {
                const ObjectId id = some(typeOf<Switch>());
                if (id) b.set(id, typeOf<Switch>(), fieldId<&Switch::choice>, toValue(std::int64_t{below(6)} - 3));
                if (id && below(2) == 0)
                    b.set(id, typeOf<Switch>(), fieldId<&Switch::mask>, toValue(std::int64_t{below(16)}));
                break;
            }
            case 10:
            case 11:
            case 12: {
                if (const ObjectId id = some(typeOf<Interest>())) setInterest(b, id);
                break;
            }
            case 13:
            case 14: {
                if (const ObjectId id = some(typeOf<CollisionObject>())) setObject(b, id);
                break;
            }
            case 15:
            case 16:
            case 17: {
                const ObjectId id = some(typeOf<Geometry>());
                if (!id) break;
                if (below(8) == 0)
                    setPrimitive(b, id, below(2) == 0);  // with indices or without
                else
                    setArrays(b, id, below(3) == 0);
                break;
            }
            case 18: {
                const ObjectId id = some(typeOf<Environment>());
                if (id)
                    b.set(id, typeOf<Environment>(), fieldId<&Environment::gravity>,
                          toValue(Vec3d(0, between(-9, 0), 0)));
                break;
            }
            default: {
                if (const ObjectId id = some(typeOf<Transform>())) setTransform(b, id);
                break;
            }
        }
    }

    std::mt19937 random_;
    std::vector<Soup> soups_;
    std::vector<ChangeList> back_;
    std::uint64_t next_ = 0;
    std::vector<std::pair<ObjectId, ObjectType>> made_;
};

}  // namespace tessera
