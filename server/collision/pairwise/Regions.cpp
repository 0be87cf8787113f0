#include "server/collision/pairwise/Regions.h"

#include "server/collision/query/Penetration.h"

namespace tessera {

ContactRegions regionsOf(const PlacedShape& a, const PlacedShape& b, std::span<const FacePair> faces) {
    ContactRegions out;
    out.regionOf.assign(faces.size(), ContactRegions::kNone);
    const Affine3d a_T_world = a.world.inverse();
    if (faces.empty() || !a_T_world.matrix().allFinite()) return out;
    // Fields enclose nothing, and each ball speaks for itself.
    for (const CollisionShape* shape : {&a.shape, &b.shape})
        if (shape->heightField() != nullptr || shape->points() != nullptr) return out;
    if (!a.shape.topology().closed() || !b.shape.topology().closed()) return out;
    const Affine3d a_T_b = a_T_world * b.world;
    std::vector<BodyContact> contacts(faces.size());
    for (std::size_t i = 0; i < faces.size(); ++i)
        contacts[i] = {faces[i],
                       contactOf(a.shape.triangle(faces[i].a), transformed(a_T_b, b.shape.triangle(faces[i].b)))};
    const PenetrationRegions found =
        penetrationRegions(a.shape.mesh(), a.shape.topology(), b.shape.mesh(), b.shape.topology(), a_T_b, contacts);
    out.regionOf = found.regionOf;
    // A direction is a linear form: what is outside stays outside, mirrored or not.
    const Mat3d world_N_a = a_T_world.linear().transpose();
    std::vector<Vec3d> middle(found.regions.size(), Vec3d::Zero());
    for (std::size_t i = 0; i < contacts.size(); ++i)
        if (const std::uint32_t region = out.regionOf[i]; region != ContactRegions::kNone)
            middle[region] += contacts[i].contact.point / static_cast<double>(found.regions[region].contacts);
    for (std::size_t i = 0; i < found.regions.size(); ++i) {
        PairDepth& region = out.regions.emplace_back();
        region.point = a.world * middle[i];
        const Vec3d form = world_N_a * found.regions[i].normal;
        const double unit = form.norm();
        if (!(unit > 0)) continue;
        region.normal = form / unit;
        if (found.regions[i].depth) region.depth = *found.regions[i].depth / unit;
    }
    return out;
}

PairDepth deepestOf(const ContactRegions& regions) {
    PairDepth deepest;
    for (const PairDepth& region : regions.regions)
        if (region.depth && (!deepest.depth || *region.depth > *deepest.depth)) deepest = region;
    return deepest;
}

}  // namespace tessera
