#include "server/collision/convex/ExactDescent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "server/collision/convex/ExactSum.h"
#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

using exact::Sum;

struct ExactVector {
    std::array<Sum, 3> at;
};

Sum dot(const ExactVector& u, const ExactVector& v) {
    return u.at[0] * v.at[0] + u.at[1] * v.at[1] + u.at[2] * v.at[2];
}
Sum dot(const ExactVector& u, const Vec3d& v) {
    return u.at[0] * v.x() + u.at[1] * v.y() + u.at[2] * v.z();
}

struct Corner {
    VertexPair from;
    ExactVector w;
};

double largestOf(std::span<const Vec3d> points) {
    double largest = 0;
    for (const Vec3d& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
    return largest;
}

std::vector<Vec3d> scaledBy(double factor, std::span<const Vec3d> points) {
    std::vector<Vec3d> out;
    out.reserve(points.size());
    for (const Vec3d& p : points) out.push_back(factor * p);
    return out;
}

class Descent {
public:
    /// Scaled by a power of two, which loses nothing, so that products stay in range.
    Descent(std::span<const Vec3d> a, std::span<const Vec3d> b) {
        const double largest = std::max(largestOf(a), largestOf(b));
        const double factor = largest > 0 ? std::ldexp(1.0, -std::ilogb(largest)) : 1.0;
        a_ = scaledBy(factor, a);
        b_ = scaledBy(factor, b);
    }

    ExactDescent run(std::span<const VertexPair> hints, bool nearest) {
        ExactDescent out;
        corners_.push_back(corner(hints.empty() ? VertexPair{} : hints.front()));
        reduce();
        for (std::size_t i = 1; i < hints.size() && direction_; ++i) offer(hints[i], true);
        for (int step = 0; direction_; ++step) {
            out.gaveUp = step == kMaxExactSteps;
            if (out.gaveUp) break;
            ++out.supports;
            out.apart = !advance(nearest);
            if (out.apart) break;
        }
        for (std::size_t i = 0; i < corners_.size(); ++i) {
            out.simplex.push_back(corners_[i].from);
            out.weights.push_back(weights_[i]);
        }
        return out;
    }

private:
    [[nodiscard]] Corner corner(const VertexPair& from) const {
        Corner c{from, {}};
        for (std::size_t i = 0; i < 3; ++i)
            c.w.at[i] = Sum::difference(a_[from.a][static_cast<int>(i)], b_[from.b][static_cast<int>(i)]);
        return c;
    }

    /// Takes the point in if it brings the simplex nearer to the origin: if it lies strictly lower along the direction
    /// than the simplex does or, if only the sign matters, if it does not lie above the origin.
    bool offer(const VertexPair& from, bool nearest) {
        Corner c = corner(from);
        Sum height = dot(*direction_, c.w);
        if (nearest) height = height - dot(*direction_, corners_.front().w);
        if (nearest ? height.sign() >= 0 : height.sign() > 0) return false;
        corners_.push_back(std::move(c));
        reduce();
        return true;
    }

    /// False: no point of the difference is lower, so the sets are apart.
    bool advance(bool nearest) {
        Vec3d d;
        for (int i = 0; i < 3; ++i) d[i] = direction_->at[static_cast<std::size_t>(i)].rounded();
        d /= d.cwiseAbs().maxCoeff();
        const std::vector<std::uint32_t> lowA = lowest(a_, d), highB = lowest(b_, -d);
        // The first of each is the best as rounded; mostly it settles the matter.
        if (offer({lowA.front(), highB.front()}, nearest)) return true;
        if (lowA.size() == 1 && highB.size() == 1) return false;
        return offer({exactlyLowest(a_, lowA, 1), exactlyLowest(b_, highB, -1)}, nearest);
    }

    /// All that may be lowest along d, as far as rounding can tell, the one that looks lowest first.
    [[nodiscard]] static std::vector<std::uint32_t> lowest(const std::vector<Vec3d>& points, const Vec3d& d) {
        Vec3d reach = Vec3d::Zero();
        for (const Vec3d& p : points) reach = reach.cwiseMax(p.cwiseAbs());
        // d's own rounding (2 units and the division's 1), products and sums.
        const double doubt = 16 * exact::kRounding * d.cwiseAbs().dot(reach);
        std::uint32_t best = 0;
        for (std::uint32_t i = 1; i < points.size(); ++i)
            if (d.dot(points[i]) < d.dot(points[best])) best = i;
        std::vector<std::uint32_t> out{best};
        const double bound = d.dot(points[best]) + doubt;
        for (std::uint32_t i = 0; i < points.size(); ++i)
            if (i != best && d.dot(points[i]) <= bound) out.push_back(i);
        return out;
    }

    [[nodiscard]] std::uint32_t exactlyLowest(const std::vector<Vec3d>& points,
                                              const std::vector<std::uint32_t>& candidates, int side) const {
        std::uint32_t best = candidates.front();
        Sum bestHeight = dot(*direction_, points[best]);
        for (const std::uint32_t c : candidates) {
            const Sum height = dot(*direction_, points[c]);
            if ((height - bestHeight).sign() * side < 0) {
                best = c;
                bestHeight = height;
            }
        }
        return best;
    }

    /// Johnson's sub-algorithm: of all parts of the simplex, the one whose affine hull is nearest to the origin at a
    /// point inside the part. Drops the other corners and sets direction and weights.
    void reduce() {
        const std::size_t n = corners_.size();
        std::array<std::array<Sum, 4>, 4> product;
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j <= i; ++j) product[i][j] = product[j][i] = dot(corners_[i].w, corners_[j].w);
        // delta[X][i], for i in X: the barycentric coordinate of the nearest point of X's affine hull, times a positive
        // number; for i not in X it is that of X with i.
        std::array<std::array<Sum, 4>, 16> delta;
        for (unsigned x = 1; x < (1u << n); ++x)
            for (std::size_t i = 0; i < n; ++i) {
                if ((x >> i & 1u) == 0) continue;
                const unsigned rest = x & ~(1u << i);
                if (rest == 0) {
                    delta[x][i] = 1.0;
                    continue;
                }
                std::size_t k = 0;
                while ((rest >> k & 1u) == 0) ++k;
                Sum sum;
                for (std::size_t j = 0; j < n; ++j)
                    if (rest >> j & 1u) sum = sum + delta[rest][j] * (product[j][k] - product[j][i]);
                delta[x][i] = sum;
            }
        for (unsigned x = 1; x < (1u << n); ++x) {
            bool nearest = true;
            for (std::size_t i = 0; i < n && nearest; ++i)
                nearest = (x >> i & 1u) ? delta[x][i].sign() > 0 : delta[x | 1u << i][i].sign() <= 0;
            if (nearest) return keep(x, delta[x]);
        }
        // Not reached by exact numbers.
        keep(1u << (n - 1), delta[1u << (n - 1)]);
    }

    void keep(unsigned part, const std::array<Sum, 4>& delta) {
        std::vector<Corner> kept;
        weights_.clear();
        ExactVector d;
        double total = 0;
        for (std::size_t i = 0; i < corners_.size(); ++i) {
            if ((part >> i & 1u) == 0) continue;
            for (std::size_t k = 0; k < 3; ++k) d.at[k] = d.at[k] + delta[i] * corners_[i].w.at[k];
            weights_.push_back(delta[i].rounded());
            total += weights_.back();
            kept.push_back(std::move(corners_[i]));
        }
        for (double& w : weights_) w /= total;
        corners_ = std::move(kept);
        direction_.reset();
        if (d.at[0].sign() != 0 || d.at[1].sign() != 0 || d.at[2].sign() != 0) direction_ = std::move(d);
    }

    std::vector<Vec3d> a_, b_;
    std::vector<Corner> corners_;
    std::vector<double> weights_;
    std::optional<ExactVector> direction_;  ///< to the nearest point of the simplex; none: that is the origin
};

}  // namespace

ExactDescent descendExactly(std::span<const Vec3d> a, std::span<const Vec3d> b, std::span<const VertexPair> hints,
                            bool nearest) {
    return Descent(a, b).run(hints, nearest);
}

}  // namespace tessera
