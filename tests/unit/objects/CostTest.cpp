/// What a list costs grows with what it changes, not with the scene: counted, not timed.
#include <functional>
#include <string>

#include "tests/unit/objects/ObjectScene.h"

namespace tessera {
namespace {

enum class Form { kBushy, kWide, kChain };

/// A scene of so many things, each a Transform's node with a geometry's node below; a few of them are objects, and one
/// interest each is in them. `subject` is one thing among the others, under a Switch.
struct LargeScene : ObjectScene {
    Thing subject;
    ObjectId choice, group, plain, hall, object, interestCore;
    std::size_t things = 0;

    LargeScene(Form form, std::size_t count) {
        ChangeListBuilder b;
        next_ = aspect.nextFreeId();
        const ObjectId box = create(b, typeOf<Geometry>());
        const Soup soup = boxSoup(Vec3d::Ones());
        b.set(box, typeOf<Geometry>(), fieldId<&Geometry::positions>, soup.positionBlob());
        b.set(box, typeOf<Geometry>(), fieldId<&Geometry::indices>, soup.indexBlob());
        hall = place(b, kRootNode, {});
        ObjectId parent = hall;
        if (form == Form::kChain)
            for (int depth = 0; depth < 240; ++depth) parent = place(b, parent, {});
        std::vector<Thing> made;
        for (std::size_t i = 0; i < count; ++i) {
            if (form != Form::kWide && i % 100 == 0)
                parent = place(b, form == Form::kChain ? lastOfChain(parent, i) : hall, {});
            if (form == Form::kChain && i == 0) chainEnd_ = parent;
            made.push_back(thing(b, parent, box, i));
        }
        choice = create(b, typeOf<Switch>());
        group = place(b, hall, choice);
        plain = place(b, hall, {});
        subject = thing(b, group, box, count);
        for (std::size_t i = 0; i < 8; ++i) {
            const ObjectId core = create(b, typeOf<CollisionObject>());
            const ObjectId node = i == 0 ? subject.node : made[i * count / 8].node;
            b.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(node));
            if (i == 0) b.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::mass>, toValue(3.0));
            place(b, kRootNode, core);
            const ObjectId interest = create(b, typeOf<Interest>());
            b.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, toValue(node));
            place(b, kRootNode, interest);
            if (i == 0) object = core;
            if (i == 0) interestCore = interest;
        }
        apply(b);
        things = count;
    }

    struct Cost {
        std::uint64_t looked = 0, anew = 0;
    };
    Cost costOf(const std::function<void(ChangeListBuilder&, LargeScene&)>& edit) {
        ChangeListBuilder b;
        next_ = aspect.nextFreeId();
        edit(b, *this);
        const ObjectHandler::Work before = handler.work();
        apply(b);
        const ObjectHandler::Work& now = handler.work();
        return {now.places + now.parts + now.groups - before.places - before.parts - before.groups,
                now.anew - before.anew};
    }

    ObjectId create(ChangeListBuilder& b, ObjectType type) {
        const ObjectId id{next_++};
        b.create(id, type);
        return id;
    }
    ObjectId place(ChangeListBuilder& b, ObjectId parent, ObjectId core) {
        const ObjectId id = create(b, typeOf<Node>());
        if (core) b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        b.place(id, parent);
        return id;
    }
    Thing thing(ChangeListBuilder& b, ObjectId parent, ObjectId box, std::size_t i) {
        Thing out;
        out.transform = create(b, typeOf<Transform>());
        b.set(out.transform, typeOf<Transform>(), fieldId<&Transform::translation>,
              toValue(Vec3d(2.0 * static_cast<double>(i % 50), 2.0 * static_cast<double>(i / 50), 0)));
        out.node = place(b, parent, out.transform);
        out.geometry = box;
        out.shape = place(b, out.node, box);
        return out;
    }

private:
    /// All groups of a chain stand at its end.
    ObjectId lastOfChain(ObjectId parent, std::size_t i) const { return i == 0 ? parent : chainEnd_; }
    std::uint64_t next_ = 0;
    ObjectId chainEnd_;
};

struct Edit {
    const char* name;
    std::function<void(ChangeListBuilder&, LargeScene&)> make;
};

std::vector<Edit> edits() {
    const auto set = [](auto id, ObjectType type, FieldId fieldId, auto value) {
        return [=](ChangeListBuilder& b, LargeScene& s) { b.set(s.*id, type, fieldId, toValue(value)); };
    };
    return {
        {"an empty node", [](auto& b, auto& s) { s.place(b, s.plain, {}); }},
        {"a node in front of all", [](auto& b, auto& s) { b.place(s.create(b, typeOf<Node>()), s.hall, 0); }},
        {"a geometry", [](auto& b, auto& s) { s.thing(b, s.hall, s.subject.geometry, 7); }},
        {"elsewhere", [](auto& b, auto& s) { b.place(s.subject.node, s.plain); }},
        {"back", [](auto& b, auto& s) { b.place(s.subject.node, s.group); }},
        {"moved",
         [](auto& b, auto& s) {
             b.set(s.subject.transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(1, 2, 3)));
         }},
        {"switched off",
         set(&LargeScene::choice, typeOf<Switch>(), fieldId<&Switch::choice>, std::int64_t{Switch::kNone})},
        {"switched on",
         set(&LargeScene::choice, typeOf<Switch>(), fieldId<&Switch::choice>, std::int64_t{Switch::kAll})},
        {"another mass", set(&LargeScene::object, typeOf<CollisionObject>(), fieldId<&CollisionObject::mass>, 4.0)},
        {"deforming", set(&LargeScene::object, typeOf<CollisionObject>(), fieldId<&CollisionObject::kind>,
                          std::int64_t{CollisionObject::kDeforming})},
        {"in other layers",
         set(&LargeScene::object, typeOf<CollisionObject>(), fieldId<&CollisionObject::layers>, std::int64_t{2})},
        {"a hull", set(&LargeScene::object, typeOf<CollisionObject>(), fieldId<&CollisionObject::shape>,
                       std::int64_t{CollisionObject::kHull})},
        {"another response", set(&LargeScene::interestCore, typeOf<Interest>(), fieldId<&Interest::response>,
                                 std::int64_t{Interest::kSlide})},
        {"another mode", set(&LargeScene::interestCore, typeOf<Interest>(), fieldId<&Interest::mode>,
                             std::int64_t{Interest::kDynamic})},
        {"disabled", set(&LargeScene::interestCore, typeOf<Interest>(), fieldId<&Interest::enabled>, false)},
        {"enabled", set(&LargeScene::interestCore, typeOf<Interest>(), fieldId<&Interest::enabled>, true)},
        {"an object and an interest in it",
         [](auto& b, auto& s) {
             const auto made = s.thing(b, s.hall, s.subject.geometry, 9);
             const ObjectId core = s.create(b, typeOf<CollisionObject>()), interest = s.create(b, typeOf<Interest>());
             b.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(made.node));
             b.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, toValue(made.node));
             s.place(b, kRootNode, core);
             s.place(b, kRootNode, interest);
         }},
        {"no core any more",
         [](auto& b, auto& s) { b.set(s.subject.shape, typeOf<Node>(), fieldId<&Node::core>, toValue(ObjectId{})); }},
        {"gone", [](auto& b, auto& s) { b.detach(s.subject.node); }},
    };
}

TEST(Cost, OfAListIsThatOfWhatItChanges) {
    for (const Form form : {Form::kBushy, Form::kWide, Form::kChain}) {
        LargeScene small(form, 500), large(form, 50'000);
        ASSERT_GE(large.handler.partCount(), 50'000u);
        for (const Edit& edit : edits()) {
            SCOPED_TRACE(std::string(edit.name) + ", form " + std::to_string(static_cast<int>(form)));
            const LargeScene::Cost few = small.costOf(edit.make), many = large.costOf(edit.make);
            EXPECT_EQ(few.anew, 0u);
            EXPECT_EQ(many.anew, 0u);
            EXPECT_LE(few.looked, 100u);
            EXPECT_LE(many.looked, few.looked + 8);
        }
    }
}

TEST(Cost, OfWhatTakesPartInNothingIsSmallAmongManyInterests) {
    ObjectScene scene;
    for (int i = 0; i < 300; ++i) {
        Interest value;
        value.object = scene.thing(kRootNode, Vec3d(3.0 * i, 0, 0), boxSoup(Vec3d::Ones())).node;
        scene.interest(value);
    }
    const ObjectHandler::Work before = scene.handler.work();
    scene.node(kRootNode);
    const ObjectHandler::Work& now = scene.handler.work();
    EXPECT_EQ(now.anew, before.anew);
    EXPECT_LE(now.places + now.parts + now.groups - before.places - before.parts - before.groups, 8u);
}

}  // namespace
}  // namespace tessera
