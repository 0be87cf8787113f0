#include "server/collision/rigid_bodies/SurfaceContacts.h"

#include <algorithm>
#include <cmath>

#include "server/collision/query/ContactQuery.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/Penetration.h"

namespace tessera::rigid {

namespace {

/// Where they cross so often, a part of it says enough about where they hold each other.
constexpr std::size_t kMostCrossings = 2000;

class Surfaces {
public:
    Surfaces(const SurfacePart& a, const SurfacePart& b, const SurfaceQuery& query, QueryWork& work,
             std::vector<ContactPoint>& out)
        : a_(a),
          b_(b),
          query_(query),
          work_(work),
          out_(out),
          a_T_b_(a.world.inverse() * b.world),
          normals_(a.world.linear().inverse().transpose()) {}

    bool find() {
        if (!a_T_b_.matrix().allFinite() || !normals_.allFinite()) return false;
        const BodyContacts found = contactsBetween(*a_.tree, *b_.tree, a_T_b_, work_, kMostCrossings);
        if (work_.exhausted()) return false;
        return found.contacts.empty() ? nearest() : crossings(found);
    }

private:
    [[nodiscard]] Vec3d toWorld(const Vec3d& normal) const {
        const Vec3d n = normals_ * normal;
        const double length = n.norm();
        return length > 0 ? Vec3d(n / length) : Vec3d::Zero();
    }

    bool nearest() {
        DistanceOptions options;
        // In A's units; a little more where A is stretched unevenly.
        const double scale = a_.world.linear().colwise().norm().minCoeff();
        if (!(scale > 0)) return false;
        options.upperBound = query_.margin / scale;
        const Distance d = distanceBetween(*a_.tree, *b_.tree, a_T_b_, work_, options);
        if (!d.complete) return false;
        if (d.farther) return true;
        const Vec3d onA = a_.world * d.onA, onB = a_.world * d.onB;
        const double gap = (onB - onA).norm();
        if (gap > 0 && gap <= query_.margin) out_.push_back({0.5 * (onA + onB), (onB - onA) / gap, gap});
        return true;
    }

    bool crossings(const BodyContacts& found) {
        std::vector<Penetration> regions;
        const bool solid = found.complete && a_.topology->closed() && b_.topology->closed();
        if (solid)
            regions =
                penetrations(a_.tree->mesh(), *a_.topology, b_.tree->mesh(), *b_.topology, a_T_b_, found.contacts);
        const std::size_t first = out_.size();
        for (const BodyContact& c : found.contacts) {
            Vec3d normal = toWorld(c.contact.normal);
            double gap = 0;
            if (const Penetration* region = regionOf(regions, c.contact.normal)) {
                normal = toWorld(region->normal);
                gap = -normal.dot(a_.world.linear() * (region->normal * *region->depth));
            } else if (!solid) {
                const Vec3d point = a_.world * c.contact.point;
                const Vec3d inwards = query_.centreOfB ? Vec3d(b_.centre - point) : Vec3d(point - a_.centre);
                if (normal.dot(inwards) < 0) normal = -normal;
            }
            if (!(normal.squaredNorm() > 0)) continue;
            gap = std::max(gap, -query_.deepest);
            for (const Vec3d& end : {c.contact.from, c.contact.to}) out_.push_back({a_.world * end, normal, gap});
        }
        reduceContacts(out_, first, query_.near);
        return true;
    }

    /// The one whose direction fits best, if one does.
    static const Penetration* regionOf(const std::vector<Penetration>& regions, const Vec3d& normal) {
        const Penetration* best = nullptr;
        double most = 0.3;
        for (const Penetration& r : regions)
            if (r.depth && std::isfinite(*r.depth) && r.normal.dot(normal) > most) {
                most = r.normal.dot(normal);
                best = &r;
            }
        return best;
    }

    const SurfacePart &a_, &b_;
    const SurfaceQuery& query_;
    QueryWork& work_;
    std::vector<ContactPoint>& out_;
    Affine3d a_T_b_;
    Mat3d normals_;
};

}  // namespace

bool contactsOfSurfaces(const SurfacePart& a, const SurfacePart& b, const SurfaceQuery& query, QueryWork& work,
                        std::vector<ContactPoint>& out) {
    return Surfaces(a, b, query, work, out).find();
}

}  // namespace tessera::rigid
