#include "server/collision/query/Penetration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "server/collision/mesh/Predicates.h"

namespace tessera {
namespace {

/// Union and find, the least member leading.
class Groups {
public:
    explicit Groups(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
    std::size_t of(std::size_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::size_t i, std::size_t j) {
        i = of(i);
        j = of(j);
        parent_[std::max(i, j)] = std::min(i, j);
    }

private:
    std::vector<std::size_t> parent_;
};

/// A point of a region, by one of the contacts that bound it.
struct Point {
    Vec3d at;
    std::size_t contact;
};

bool bothSides(const std::array<int, 3>& s) {
    return std::min({s[0], s[1], s[2]}) < 0 && std::max({s[0], s[1], s[2]}) > 0;
}
/// A contact where the surfaces cross, seen from one of the bodies.
struct Crossing {
    std::size_t contact;
    std::uint32_t face, otherFace;
    Triangle own, other;
};

/// The part of one body's surface that lies inside the other.
class Patches {
public:
    /// inside: the sign of orient3d for what lies inside the other body.
    Patches(const TriangleMesh& mesh, const SurfaceTopology& topology, const Affine3d& map, int inside, Groups& regions)
        : mesh_(mesh), topology_(topology), map_(map), inside_(inside), regions_(regions) {}

    void collect(const std::vector<Crossing>& crossings, std::vector<Point>& points) {
        for (const Crossing& c : crossings) {
            if (crossed_.insert(c.face).second) faces_.push_back(c.face);
            pierce(c);
        }
        // A curve goes on where an edge passes through a triangle: from one of the edge's faces to the other.
        std::sort(joints_.begin(), joints_.end());
        for (std::size_t i = 1; i < joints_.size(); ++i)
            if (joints_[i].edge == joints_[i - 1].edge && joints_[i].otherFace == joints_[i - 1].otherFace)
                regions_.join(joints_[i].contact, joints_[i - 1].contact);
        spreadLabels();
        for (const std::uint32_t face : faces_)
            for (unsigned i = 0; i < 3; ++i) {
                const std::uint32_t vertex = mesh_.vertexOf(face, i);
                const Label* const label = insideLabel(vertex);
                if (label == nullptr) continue;
                points.push_back({map_ * mesh_.corner(face, i), label->contact});
                // An edge that is not pierced has both its ends inside.
                enter(topology_.across(face, i), label->contact, vertex, mesh_.vertexOf(face, (i + 1) % 3));
                enter(topology_.across(face, (i + 2) % 3), label->contact, vertex, mesh_.vertexOf(face, (i + 2) % 3));
            }
        flood(points);
    }

private:
    struct Label {
        double near = 0;  ///< how far along its edge the other surface is; of those the nearest tells
        bool inside = false;
        std::size_t contact = 0;  ///< there
    };
    struct Joint {
        std::uint64_t edge;
        std::uint32_t otherFace;
        std::size_t contact;
        auto operator<=>(const Joint&) const = default;
    };

    [[nodiscard]] const Label* insideLabel(std::uint32_t vertex) const {
        const auto label = labels_.find(topology_.place(vertex));
        return label != labels_.end() && label->second.inside ? &label->second : nullptr;
    }
    [[nodiscard]] std::uint64_t edge(std::uint32_t u, std::uint32_t v) const {
        const std::uint64_t p = topology_.place(u), q = topology_.place(v);
        return std::min(p, q) << 32U | std::max(p, q);
    }

    /// Where the edges of a face pass through a triangle of the other body, their ends learn what side they are on.
    void pierce(const Crossing& c) {
        const std::array<int, 3> side = sidesOf(c.other, c.own);
        const Vec3d normal = outside(c.other);
        for (unsigned i = 0; i < 3; ++i) {
            const unsigned j = (i + 1) % 3;
            if (side[i] * side[j] >= 0) continue;
            const Vec3d &u = c.own[i], &v = c.own[j];
            int low = 1, high = -1;
            for (std::size_t k = 0; k < 3; ++k) {
                const int s = orient3d(u, v, c.other[k], c.other[(k + 1) % 3]);
                low = std::min(low, s);
                high = std::max(high, s);
            }
            if (low < 0 && high > 0) continue;
            const double du = std::abs(normal.dot(u - c.other[0])), dv = std::abs(normal.dot(v - c.other[0])),
                         length = (v - u).norm();
            const double share = du + dv > 0 ? du / (du + dv) : 0.5;
            tell(mesh_.vertexOf(c.face, i), {share * length, side[i] == inside_, c.contact});
            tell(mesh_.vertexOf(c.face, j), {(1 - share) * length, side[j] == inside_, c.contact});
            joints_.push_back({edge(mesh_.vertexOf(c.face, i), mesh_.vertexOf(c.face, j)), c.otherFace, c.contact});
            pierced_.insert(joints_.back().edge);
        }
    }
    void tell(std::uint32_t vertex, const Label& label) {
        const auto [place, isNew] = labels_.emplace(topology_.place(vertex), label);
        if (!isNew && label.near < place->second.near) place->second = label;
    }

    /// Along edges that nothing pierces; faces that are pierced in their middle only have no other way to know.
    void spreadLabels() {
        for (bool changed = true; changed;) {
            changed = false;
            for (const std::uint32_t face : faces_)
                for (unsigned i = 0; i < 3; ++i) {
                    const std::uint32_t u = mesh_.vertexOf(face, i), v = mesh_.vertexOf(face, (i + 1) % 3);
                    const auto lu = labels_.find(topology_.place(u)), lv = labels_.find(topology_.place(v));
                    if ((lu == labels_.end()) == (lv == labels_.end()) || pierced_.contains(edge(u, v))) continue;
                    const Label known = lu == labels_.end() ? lv->second : lu->second;
                    labels_.emplace(topology_.place(lu == labels_.end() ? u : v), known);
                    changed = true;
                }
        }
    }

    /// A patch goes on into a face, over an edge that is inside; by a contact that bounds it.
    void enter(std::uint32_t face, std::size_t contact, std::uint32_t u, std::uint32_t v) {
        if (face == SurfaceTopology::kNone || pierced_.contains(edge(u, v))) return;
        if (crossed_.contains(face)) {
            if (const Label* const label = insideLabel(u)) regions_.join(label->contact, contact);
            return;
        }
        const auto [place, isNew] = reached_.emplace(face, contact);
        if (isNew)
            waiting_.push_back(face);
        else
            regions_.join(place->second, contact);
    }
    void flood(std::vector<Point>& points) {
        while (!waiting_.empty()) {
            const std::uint32_t face = waiting_.back();
            waiting_.pop_back();
            const std::size_t contact = reached_.at(face);
            for (unsigned i = 0; i < 3; ++i) {
                points.push_back({map_ * mesh_.corner(face, i), contact});
                enter(topology_.across(face, i), contact, mesh_.vertexOf(face, i), mesh_.vertexOf(face, (i + 1) % 3));
            }
        }
    }

    const TriangleMesh& mesh_;
    const SurfaceTopology& topology_;
    const Affine3d& map_;
    int inside_;
    Groups& regions_;
    std::unordered_set<std::uint32_t> crossed_;
    std::vector<std::uint32_t> faces_;                 ///< that are crossed
    std::unordered_map<std::uint32_t, Label> labels_;  ///< by place
    std::unordered_set<std::uint64_t> pierced_;        ///< edges
    std::vector<Joint> joints_;
    std::unordered_map<std::uint32_t, std::size_t>
        reached_;  ///< faces wholly inside, by a contact that bounds their patch
    std::vector<std::uint32_t> waiting_;
};

}  // namespace

std::vector<Penetration> penetrations(const TriangleMesh& a, const SurfaceTopology& topologyA, const TriangleMesh& b,
                                      const SurfaceTopology& topologyB, const Affine3d& a_T_b,
                                      const std::vector<BodyContact>& contacts) {
    return penetrationRegions(a, topologyA, b, topologyB, a_T_b, contacts).regions;
}

PenetrationRegions penetrationRegions(const TriangleMesh& a, const SurfaceTopology& topologyA, const TriangleMesh& b,
                                      const SurfaceTopology& topologyB, const Affine3d& a_T_b,
                                      const std::vector<BodyContact>& contacts) {
    PenetrationRegions found;
    found.regionOf.assign(contacts.size(), PenetrationRegions::kNone);
    const double turn = a_T_b.linear().determinant();
    if (!topologyA.closed() || !topologyB.closed() || turn == 0) return found;
    std::vector<Crossing> ofA, ofB;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        const FacePair& faces = contacts[i].faces;
        const Triangle ta = a.triangle(faces.a), tb = transformed(a_T_b, b.triangle(faces.b));
        if (!bothSides(sidesOf(ta, tb)) || !bothSides(sidesOf(tb, ta))) continue;
        ofA.push_back({i, faces.a, faces.b, ta, tb});
        ofB.push_back({i, faces.b, faces.a, tb, ta});
    }
    Groups regions(contacts.size());
    std::vector<Point> points;
    // orient3d is positive on the side that a triangle's corners are seen counter-clockwise from: outside, if not
    // mirrored.
    Patches(a, topologyA, Affine3d::Identity(), turn > 0 ? -1 : 1, regions).collect(ofA, points);
    Patches(b, topologyB, a_T_b, -1, regions).collect(ofB, points);

    struct Sum {
        Vec3d area = Vec3d::Zero(), about = Vec3d::Zero();
        double length = 0, low = 0, high = 0;
        std::size_t place = 0;
        bool any = false;
    };
    std::vector<Penetration>& out = found.regions;
    std::unordered_map<std::size_t, Sum> sums;
    for (const Crossing& c : ofA) {
        const TriangleContact& contact = contacts[c.contact].contact;
        const auto [place, isNew] = sums.try_emplace(regions.of(c.contact));
        Sum& sum = place->second;
        if (isNew) {
            sum.about = contact.from;
            sum.place = out.size();
            out.push_back({.first = c.contact});
        }
        ++out[sum.place].contacts;
        found.regionOf[c.contact] = static_cast<std::uint32_t>(sum.place);
        sum.area += 0.5 * (contact.from - sum.about).cross(contact.to - sum.about) * (turn > 0 ? 1 : -1);
        sum.length += (contact.to - contact.from).norm();
        points.push_back({contact.from, c.contact});
        points.push_back({contact.to, c.contact});
    }
    for (auto& [region, sum] : sums) {
        // A circle's area is 0.08 of its length's square: far below that there is no direction.
        constexpr double kLeastArea = 1e-6;
        if (!(sum.area.norm() > kLeastArea * sum.length * sum.length)) continue;
        out[sum.place].normal = sum.area.normalized();
    }
    for (const Point& point : points) {
        Sum& sum = sums.at(regions.of(point.contact));
        const double at = out[sum.place].normal.dot(point.at - sum.about);
        sum.low = sum.any ? std::min(sum.low, at) : at;
        sum.high = sum.any ? std::max(sum.high, at) : at;
        sum.any = true;
    }
    for (const auto& [region, sum] : sums)
        if (out[sum.place].normal != Vec3d::Zero()) out[sum.place].depth = sum.high - sum.low;
    return found;
}

}  // namespace tessera
