#include "server/collision/convex/Simplex.h"

#include <cmath>
#include <limits>

#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

/// The part of a simplex that is nearest: which points, where.
struct Part {
    std::array<int, 4> points{};
    int size = 0;
    double squared = std::numeric_limits<double>::infinity();
    Vec3d direction = Vec3d::Zero();
};

class Reduction {
public:
    explicit Reduction(const Simplex& simplex) {
        for (int i = 0; i < simplex.size; ++i) w_[i] = simplex.points[static_cast<std::size_t>(i)].w;
    }

    [[nodiscard]] Part point(int i) const { return {{i}, 1, w_[i].squaredNorm(), w_[i]}; }

    [[nodiscard]] Part segment(int i, int j) const {
        const Vec3d e = w_[j] - w_[i];
        const double along = -w_[i].dot(e), length = e.squaredNorm();
        if (!(along > 0)) return point(i);
        if (!(along < length)) return point(j);
        const Vec3d across = e.cross(w_[i]);
        return {{i, j}, 2, across.squaredNorm() / length, across.cross(e)};
    }

    [[nodiscard]] Part triangle(int i, int j, int k) const {
        const Vec3d &a = w_[i], &b = w_[j], &c = w_[k];
        const Vec3d ab = b - a, bc = c - b, ca = a - c;
        const Vec3d n = ab.cross(-ca);
        Part best;
        bool inside = n.squaredNorm() > 0;
        const auto edge = [&](int from, int to, const Vec3d& e) {
            // On the inner side of the edge: e × n looks outwards.
            if (e.cross(n).dot(w_[from]) > 0) return;
            inside = false;
            const Part part = segment(from, to);
            if (part.squared < best.squared) best = part;
        };
        edge(i, j, ab);
        edge(j, k, bc);
        edge(k, i, ca);
        if (!inside) return best;
        const double height = n.dot(a);
        return {{i, j, k}, 3, height * height / n.squaredNorm(), height < 0 ? Vec3d(-n) : n};
    }

    /// Size 4: surely inside.
    [[nodiscard]] Part tetrahedron() const {
        constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}};
        Part best;
        bool inside = true;
        for (const auto& f : kFaces) {
            if (surelyBehind(f[0], f[1], f[2], f[3])) continue;
            inside = false;
            const Part part = triangle(f[0], f[1], f[2]);
            if (part.squared < best.squared) best = part;
        }
        if (inside) return {{0, 1, 2, 3}, 4, 0, Vec3d::Zero()};
        return best;
    }

private:
    /// The origin lies on the same side of the plane of i, j, k as the point l, strictly, for the true differences.
    [[nodiscard]] bool surelyBehind(int i, int j, int k, int l) const {
        const Vec3d &a = w_[i], &b = w_[j], &c = w_[k], &d = w_[l];
        const Vec3d n = (b - a).cross(c - a);
        // Of each product of three: its factors are rounded twice each, the product twice, the sums four times.
        const Vec3d size = a.cwiseAbs();
        const Vec3d ab = b.cwiseAbs() + size, ac = c.cwiseAbs() + size;
        const Vec3d most(ab.y() * ac.z() + ab.z() * ac.y(), ab.z() * ac.x() + ab.x() * ac.z(),
                         ab.x() * ac.y() + ab.y() * ac.x());
        const double origin = -n.dot(a), other = n.dot(d - a);
        constexpr double kTiny = std::numeric_limits<double>::min();  // products may lose all that is smaller
        const double doubtOfOrigin = 24 * exact::kRounding * most.dot(size) + kTiny;
        const double doubtOfOther = 24 * exact::kRounding * most.dot(d.cwiseAbs() + size) + kTiny;
        return (origin > doubtOfOrigin && other > doubtOfOther) || (-origin > doubtOfOrigin && -other > doubtOfOther);
    }

    Vec3d w_[4];
};

}  // namespace

SimplexNearest reduce(Simplex& simplex) {
    const Reduction reduction(simplex);
    Part part;
    switch (simplex.size) {
        case 1:
            part = reduction.point(0);
            break;
        case 2:
            part = reduction.segment(0, 1);
            break;
        case 3:
            part = reduction.triangle(0, 1, 2);
            break;
        default:
            part = reduction.tetrahedron();
            break;
    }
    if (part.size == 4) return {true, 0, Vec3d::Zero()};
    Simplex kept;
    for (int i = 0; i < part.size; ++i)
        kept.push(simplex.points[static_cast<std::size_t>(part.points[static_cast<std::size_t>(i)])]);
    simplex = kept;
    return {false, std::sqrt(part.squared), part.direction};
}

}  // namespace tessera
