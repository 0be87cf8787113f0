#include "server/collision/objects/BodyRules.h"

namespace tessera {

BodyRules::BodyRules(const Aspect& aspect, const VisibleTree& tree) : tree_(tree) {
    const std::size_t n = tree.places.size();
    object_.assign(n, kNone);
    top_.assign(n, kNone);
    made_.assign(n, kNone);
    objectsUpTo_.assign(n + 1, 0);

    std::vector<const CollisionObject*> cores;
    std::vector<ObjectId> named;
    for (const ObjectId id : tree.objects) {
        cores.push_back(aspect.get<CollisionObject>(id));
        named.push_back(cores.back()->node);
    }
    const std::vector<std::uint32_t> places = tree.find(named);
    // Ascending ids: of several cores that name one node the lowest counts.
    std::vector<std::uint32_t> objectAt(n, kNone);
    for (std::uint32_t k = 0; k < places.size(); ++k)
        if (places[k] != Place::kNone && objectAt[places[k]] == kNone) objectAt[places[k]] = k;

    for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t parent = tree.places[i].parent;
        const bool own = objectAt[i] != kNone;
        if (own)
            object_[i] = objectAt[i];
        else if (parent != Place::kNone)
            object_[i] = object_[parent];
        if (object_[i] == kNone) continue;
        const CollisionObject& core = *cores[object_[i]];
        const bool child = !own && core.division == CollisionObject::kEachChild && objectAt[parent] != kNone;
        const bool alone = own || child || core.division == CollisionObject::kEachGeometry;
        top_[i] = alone ? i : top_[parent];
        if ((own || child) && core.layers != 0) objectsUpTo_[i + 1] = 1;
    }
    for (const VisibleTree::GeometryPlace& geometry : tree.geometries) {
        const std::uint32_t k = object_[geometry.place];
        if (k != kNone && cores[k]->layers != 0 && cores[k]->division == CollisionObject::kEachGeometry)
            objectsUpTo_[geometry.place + 1] = 1;
    }
    for (std::size_t i = 0; i < n; ++i) objectsUpTo_[i + 1] += objectsUpTo_[i];
}

bool BodyRules::anyObjectAt(std::uint32_t place) const {
    return objectsUpTo_[tree_.places[place].end] > objectsUpTo_[place];
}

void BodyRules::finish() {
    for (std::uint32_t i = 0; i < made_.size(); ++i)
        if (made_[i] == kNone && tree_.places[i].parent != Place::kNone) made_[i] = made_[tree_.places[i].parent];
}

}  // namespace tessera
