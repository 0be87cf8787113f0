#include "server/optimise/EqualObjects.h"

#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/NurbsSurface.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/cores/SurfaceParts.h"

namespace tessera {
namespace {

/// What is named comes before what names it, so that equal materials have one image already when they are compared.
constexpr ObjectType kShareable[] = {Image::kType,           TextureLayer::kType, SurfaceProgram::kType,
                                     Material::kType,        Geometry::kType,     SubdivisionSurface::kType,
                                     NurbsSurfaceCore::kType};

bool isShareable(ObjectType type) {
    for (const ObjectType one : kShareable)
        if (one == type) return true;
    return false;
}

bool equal(const Object& a, const Object& b) {
    for (const FieldEntry& field : a.info().fields)
        if (field.load(a) != field.load(b)) return false;
    return true;
}

/// Those that somebody names who may write them, or means this one alone.
std::unordered_set<ObjectId> meantAlone(const Aspect& scene) {
    std::unordered_set<ObjectId> alone;
    for (const ObjectId id : scene.ids()) {
        const Object object = scene.find(id);
        if (object.is<Node>() || isShareable(typeOf(object)) || object.is<MaterialGroup>() || object.is<Text>() ||
            object.is<Skin>() || object.is<Deformation>())
            continue;
        forEachRef(object, [&](ObjectId to) { alone.insert(to); });
    }
    return alone;
}

}  // namespace

Expected<std::size_t> shareEqualObjects(Aspect& scene) {
    const std::unordered_set<ObjectId> alone = meantAlone(scene);
    std::size_t gone = 0;
    for (const ObjectType type : kShareable) {
        std::unordered_map<std::uint64_t, std::vector<ObjectId>> byHash;
        std::unordered_map<ObjectId, ObjectId> insteadOf;
        for (const ObjectId id : scene.ids()) {
            const Object object = scene.find(id);
            if (typeOf(object) != type || alone.contains(id)) continue;
            std::vector<ObjectId>& same = byHash[object.info().hash(object.data(), 1)];
            bool known = false;
            for (const ObjectId first : same)
                if (equal(scene.find(first), object)) {
                    insteadOf.emplace(id, first);
                    known = true;
                    break;
                }
            if (!known) same.push_back(id);
        }
        if (insteadOf.empty()) continue;
        ChangeListBuilder list;
        const auto other = [&](ObjectId id) {
            const auto found = insteadOf.find(id);
            return found == insteadOf.end() ? id : found->second;
        };
        for (const ObjectId id : scene.ids()) {
            if (insteadOf.contains(id)) continue;
            const Object object = scene.find(id);
            for (const FieldEntry& field : object.info().fields) {
                if (!field.holdsRefs()) continue;
                FieldValue value = field.load(object);
                if (auto* one = std::get_if<ObjectId>(&value)) *one = other(*one);
                if (auto* several = std::get_if<RefList>(&value))
                    for (ObjectId& one : *several) one = other(one);
                if (value != field.load(object)) list.set(id, typeOf(object), field.id, value);
            }
        }
        for (const auto& [id, first] : insteadOf) list.destroy(id);
        gone += insteadOf.size();
        if (Expected<void> applied = scene.apply(list.take()); !applied) return tl::unexpected(applied.error());
    }
    return gone;
}

}  // namespace tessera
