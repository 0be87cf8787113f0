#include "tests/bench/SceneTreeOurs.h"

#include <memory>

#include "client/render/RenderAction.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "tests/bench/SceneSide.h"
#include "tests/bench/SceneTree.h"

namespace tessera::bench {
namespace {

ObjectId nodeId(std::uint64_t place) {
    return ObjectId{2 + 2 * place};
}
ObjectId transformId(std::uint64_t place) {
    return ObjectId{3 + 2 * place};
}

void setPlace(ChangeListBuilder& list, ObjectId id, const TreePlace& place) {
    const double* t = place.translation;
    const double* r = place.rotation;
    const double* s = place.scale;
    list.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(t[0], t[1], t[2])));
    list.set(id, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(Quatd(r[0], r[1], r[2], r[3])));
    list.set(id, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(Vec3d(s[0], s[1], s[2])));
}

class OurTree : public TreeSide {
public:
    explicit OurTree(std::uint64_t count)
        : places_(treePlaces(count)), changed_{changedPlaces(count, 1), changedPlaces(count, 2)} {}

    void clear() override {
        render_.reset();
        aspect_ = Aspect();
    }

    void build() override {
        const double start = threadSeconds();
        const ChangeList list = treeList(places_);
        saying = threadSeconds() - start;
        must(aspect_.apply(list).has_value());
    }

    double traverse() override {
        double sum = 0;
        Action action;
        action.onNode([&](const Visit& visit) {
            // The scene's own root is no place of the tree.
            if (visit.depth > 0) sum += visit.world_T_node.translation().sum();
            return Descend::kInto;
        });
        action.run(aspect_);
        return sum;
    }

    void change() override { must(aspect_.apply(changes()).has_value()); }

    double look() override {
        double sum = 0;
        for (std::size_t k = 0; k < changed_[0].size(); ++k)
            sum += worldTransform(aspect_, nodeId(changedPlace(k))).translation().sum();
        return sum;
    }

    double changeKept() override {
        const bool first = !render_;
        if (first) render_ = std::make_unique<RenderScene>();
        const ChangeList list = changes();
        must(aspect_.apply(list).has_value());
        render_->update(aspect_, first ? nullptr : &list);
        return 0;
    }

private:
    ChangeList changes() {
        const std::vector<TreePlace>& to = changed_[turn_++ & 1];
        const double start = threadSeconds();
        ChangeListBuilder builder;
        for (std::size_t k = 0; k < to.size(); ++k) setPlace(builder, transformId(changedPlace(k)), to[k]);
        ChangeList list = builder.take();
        saying = threadSeconds() - start;
        return list;
    }

    std::vector<TreePlace> places_, changed_[2];
    Aspect aspect_;
    std::unique_ptr<RenderScene> render_;
    unsigned turn_ = 0;
};

}  // namespace

ChangeList treeList(std::span<const TreePlace> places) {
    ChangeListBuilder list;
    for (std::uint64_t i = 0; i < places.size(); ++i) {
        list.create(transformId(i), typeOf<Transform>());
        setPlace(list, transformId(i), places[i]);
        list.create(nodeId(i), typeOf<Node>());
        list.set(nodeId(i), typeOf<Node>(), fieldId<&Node::core>, toValue(transformId(i)));
        list.place(nodeId(i), i == 0 ? kRootNode : nodeId(parentOf(i)));
    }
    return list.take();
}

void must(bool done) {
    TESSERA_CHECK(done, "a list of the benchmark was refused");
}

int serveOurTree(std::uint64_t places) {
    OurTree tree(places);
    return serveTree(tree);
}

}  // namespace tessera::bench
