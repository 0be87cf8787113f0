#include "tests/bench/SceneTreeOurs.h"

#include <memory>

#include "client/render/order/RenderAction.h"
#include "common/cores/Transform.h"
#include "common/scene/Action.h"
#include "common/scene/Column.h"
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

/// The columns of many transforms.
struct PlaceColumns {
    explicit PlaceColumns(std::size_t count) : translations(count), rotations(count), scales(count) {}
    void add(ObjectId id, const TreePlace& place) {
        const double* r = place.rotation;
        translations.add(id, Eigen::Map<const Vec3d>(place.translation));
        rotations.add(id, Quatd(r[0], r[1], r[2], r[3]));
        scales.add(id, Eigen::Map<const Vec3d>(place.scale));
    }
    void moveTo(ChangeList& list) {
        list.columns.push_back(translations.take());
        list.columns.push_back(rotations.take());
        list.columns.push_back(scales.take());
    }
    Column<&Transform::translation> translations;
    Column<&Transform::rotation> rotations;
    Column<&Transform::scale> scales;
};

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
        WorldTransforms worlds(aspect_);
        for (std::size_t k = 0; k < changed_[0].size(); ++k)
            sum += worlds.of(nodeId(changedPlace(k))).translation().sum();
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
        PlaceColumns columns(to.size());
        for (std::size_t k = 0; k < to.size(); ++k) columns.add(transformId(changedPlace(k)), to[k]);
        ChangeList list;
        columns.moveTo(list);
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
    const std::size_t count = places.size();
    ChangeList list;
    list.creations.reserve(2 * count);
    list.placements.reserve(count);
    PlaceColumns columns(count);
    Column<&Node::core> cores(count);
    for (std::uint64_t i = 0; i < count; ++i) {
        list.creations.push_back({nodeId(i), typeOf<Node>()});
        list.creations.push_back({transformId(i), typeOf<Transform>()});
        columns.add(transformId(i), places[i]);
        cores.add(nodeId(i), transformId(i));
        list.placements.push_back({nodeId(i), i == 0 ? kRootNode : nodeId(parentOf(i))});
    }
    list.columns.push_back(cores.take());
    columns.moveTo(list);
    return list;
}

void must(bool done) {
    TESSERA_CHECK(done, "a list of the benchmark was refused");
}

int serveOurTree(std::uint64_t places) {
    OurTree tree(places);
    return serveTree(tree);
}

}  // namespace tessera::bench
