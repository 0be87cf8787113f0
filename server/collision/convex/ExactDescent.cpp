#include "server/collision/convex/ExactDescent.h"

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <type_traits>

#include "server/collision/convex/ExactSum.h"
#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

using exact::Sum;
using Whole = boost::multiprecision::cpp_int;

/// A power of two. All coordinates are multiples of it.
struct Unit {
    int exponent = 0;
};

template <typename Number>
Number numberOf(double value, Unit unit);
template <>
Sum numberOf(double value, Unit) {
    return value;
}
template <>
Whole numberOf(double value, Unit unit) {
    int exponent = 0;
    const double share = std::frexp(value, &exponent);
    constexpr int kBits = std::numeric_limits<double>::digits;
    Whole whole = static_cast<std::int64_t>(std::ldexp(share, kBits));
    const int shift = exponent - kBits - unit.exponent;
    // Bits of a number below the unit are zeros.
    if (shift >= 0) return whole << shift;
    return whole / (Whole(1) << -shift);
}

int signOf(const Sum& number) {
    return number.sign();
}
int signOf(const Whole& number) {
    return number.sign();
}

/// Each to within a unit in its last place, of the largest of them; all times one positive factor.
std::vector<double> roundedOf(std::span<const Sum> numbers) {
    std::vector<double> out;
    for (const Sum& number : numbers) out.push_back(number.rounded());
    return out;
}
std::vector<double> roundedOf(std::span<const Whole> numbers) {
    constexpr std::size_t kMostBits = 900;
    std::size_t bits = 0;
    for (const Whole& number : numbers)
        if (!number.is_zero()) bits = std::max<std::size_t>(bits, boost::multiprecision::msb(abs(number)) + 1);
    const std::size_t cut = bits > kMostBits ? bits - kMostBits : 0;
    std::vector<double> out;
    for (const Whole& number : numbers) {
        const Whole left = abs(number) >> cut;
        out.push_back(number.sign() * left.convert_to<double>());
    }
    return out;
}

template <typename Number>
using Vector = std::array<Number, 3>;

template <typename Number>
Number dot(const Vector<Number>& u, const Vector<Number>& v) {
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}

/// How far numbers reach: exponents of the largest one, and of the least bit of any.
struct Reach {
    int top = 0, bottom = 0;
};

Reach reachOf(std::span<const Vec3d> a, std::span<const Vec3d> b) {
    double largest = 0, least = std::numeric_limits<double>::infinity();
    for (const std::span<const Vec3d> points : {a, b})
        for (const Vec3d& p : points)
            for (int i = 0; i < 3; ++i) {
                if (p[i] == 0) continue;
                largest = std::max(largest, std::abs(p[i]));
                least = std::min(least, std::abs(p[i]));
            }
    if (!(largest > 0)) return {};
    constexpr int kBitsBehind = std::numeric_limits<double>::digits - 1;
    constexpr int kLeastBit = std::numeric_limits<double>::min_exponent - std::numeric_limits<double>::digits;
    return {std::ilogb(largest), std::max(std::ilogb(least) - kBitsBehind, kLeastBit)};
}

std::vector<Vec3d> scaledBy(int exponent, std::span<const Vec3d> points) {
    std::vector<Vec3d> out;
    out.reserve(points.size());
    for (const Vec3d& p : points)
        out.emplace_back(std::ldexp(p.x(), exponent), std::ldexp(p.y(), exponent), std::ldexp(p.z(), exponent));
    return out;
}

/// In numbers that hold what their points need.
template <typename Number>
class Descent {
public:
    /// `scale`: the points times two to this power, for a first look in double, which may lose what is tiny beside the
    /// largest. Sums are of those, whole numbers of the points as they are.
    Descent(std::span<const Vec3d> a, std::span<const Vec3d> b, int scale, Unit unit)
        : scaledA_(scaledBy(scale, a)),
          scaledB_(scaledBy(scale, b)),
          a_(std::is_same_v<Number, Sum> ? std::span<const Vec3d>(scaledA_) : a),
          b_(std::is_same_v<Number, Sum> ? std::span<const Vec3d>(scaledB_) : b),
          unit_(unit) {}

    ExactDescent run(std::span<const VertexPair> hints, bool nearest) {
        ExactDescent out;
        corners_.push_back(corner(hints.empty() ? VertexPair{} : hints.front()));
        reduce();
        for (std::size_t i = 1; i < hints.size() && direction_ && !gaveUp_; ++i) offer(hints[i], true);
        for (int step = 0; direction_; ++step) {
            out.gaveUp = gaveUp_ || step == kMaxExactSteps;
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
    struct Corner {
        VertexPair from;
        Vector<Number> w;
    };

    [[nodiscard]] Vector<Number> vectorOf(const Vec3d& p) const {
        return {numberOf<Number>(p.x(), unit_), numberOf<Number>(p.y(), unit_), numberOf<Number>(p.z(), unit_)};
    }
    [[nodiscard]] Number difference(double a, double b) const {
        if constexpr (std::is_same_v<Number, Sum>)
            return Sum::difference(a, b);
        else
            return numberOf<Number>(a, unit_) - numberOf<Number>(b, unit_);
    }
    [[nodiscard]] Corner corner(const VertexPair& from) const {
        const Vec3d &a = a_[from.a], &b = b_[from.b];
        return {from, {difference(a.x(), b.x()), difference(a.y(), b.y()), difference(a.z(), b.z())}};
    }

    /// Takes the point in if it brings the simplex nearer to the origin: if it lies strictly lower along the direction
    /// than the simplex does or, if only the sign matters, if it does not lie above the origin.
    bool offer(const VertexPair& from, bool nearest) {
        Corner c = corner(from);
        Number height = dot(*direction_, c.w);
        if (nearest) height = height - dot(*direction_, corners_.front().w);
        if (nearest ? signOf(height) >= 0 : signOf(height) > 0) return false;
        corners_.push_back(std::move(c));
        reduce();
        return true;
    }

    /// False: no point of the difference is lower, so the sets are apart.
    bool advance(bool nearest) {
        const std::vector<double> rounded = roundedOf(*direction_);
        Vec3d d(rounded[0], rounded[1], rounded[2]);
        d /= d.cwiseAbs().maxCoeff();
        const std::vector<std::uint32_t> lowA = lowest(scaledA_, d), highB = lowest(scaledB_, -d);
        // The first of each is the best as rounded; mostly it settles the matter.
        if (offer({lowA.front(), highB.front()}, nearest)) return true;
        if (lowA.size() == 1 && highB.size() == 1) return false;
        return offer({exactlyLowest(a_, lowA, 1), exactlyLowest(b_, highB, -1)}, nearest);
    }

    /// All that may be lowest along d, as far as rounding can tell, the one that looks lowest first.
    [[nodiscard]] static std::vector<std::uint32_t> lowest(const std::vector<Vec3d>& points, const Vec3d& d) {
        Vec3d reach = Vec3d::Zero();
        for (const Vec3d& p : points) reach = reach.cwiseMax(p.cwiseAbs());
        // d's own rounding (2 units and the division's 1), products and sums; and what is too small for them.
        const double doubt =
            16 * exact::kRounding * d.cwiseAbs().dot(reach) + 64 * std::numeric_limits<double>::denorm_min();
        std::uint32_t best = 0;
        for (std::uint32_t i = 1; i < points.size(); ++i)
            if (d.dot(points[i]) < d.dot(points[best])) best = i;
        std::vector<std::uint32_t> out{best};
        const double bound = d.dot(points[best]) + doubt;
        for (std::uint32_t i = 0; i < points.size(); ++i)
            if (i != best && d.dot(points[i]) <= bound) out.push_back(i);
        return out;
    }

    [[nodiscard]] std::uint32_t exactlyLowest(std::span<const Vec3d> points,
                                              const std::vector<std::uint32_t>& candidates, int side) const {
        std::uint32_t best = candidates.front();
        Number bestHeight = dot(*direction_, vectorOf(points[best]));
        for (const std::uint32_t c : candidates) {
            const Number height = dot(*direction_, vectorOf(points[c]));
            if (signOf(Number(height - bestHeight)) * side < 0) {
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
        std::array<std::array<Number, 4>, 4> product;
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j <= i; ++j) product[i][j] = product[j][i] = dot(corners_[i].w, corners_[j].w);
        // delta[X][i], for i in X: the barycentric coordinate of the nearest point of X's affine hull, times a positive
        // number; for i not in X it is that of X with i.
        std::array<std::array<Number, 4>, 16> delta;
        for (unsigned x = 1; x < (1u << n); ++x)
            for (std::size_t i = 0; i < n; ++i) {
                if ((x >> i & 1u) == 0) continue;
                const unsigned rest = x & ~(1u << i);
                if (rest == 0) {
                    delta[x][i] = 1;
                    continue;
                }
                std::size_t k = 0;
                while ((rest >> k & 1u) == 0) ++k;
                Number sum = 0;
                for (std::size_t j = 0; j < n; ++j)
                    if (rest >> j & 1u) sum = sum + delta[rest][j] * (product[j][k] - product[j][i]);
                delta[x][i] = sum;
            }
        for (unsigned x = 1; x < (1u << n); ++x) {
            bool nearest = true;
            for (std::size_t i = 0; i < n && nearest; ++i)
                nearest = (x >> i & 1u) ? signOf(delta[x][i]) > 0 : signOf(delta[x | 1u << i][i]) <= 0;
            if (nearest) return keep(x, delta[x]);
        }
        // Not reached by exact numbers.
        gaveUp_ = true;
        keep(1u << (n - 1), delta[1u << (n - 1)]);
    }

    void keep(unsigned part, const std::array<Number, 4>& delta) {
        std::vector<Corner> kept;
        std::vector<Number> weights;
        Vector<Number> d;
        for (std::size_t i = 0; i < corners_.size(); ++i) {
            if ((part >> i & 1u) == 0) continue;
            for (std::size_t k = 0; k < 3; ++k) d[k] = d[k] + delta[i] * corners_[i].w[k];
            weights.push_back(delta[i]);
            kept.push_back(std::move(corners_[i]));
        }
        weights_ = roundedOf(weights);
        const double total = std::accumulate(weights_.begin(), weights_.end(), 0.0);
        for (double& w : weights_) w /= total;
        corners_ = std::move(kept);
        direction_.reset();
        if (std::ranges::any_of(d, [](const Number& at) { return signOf(at) != 0; })) direction_ = std::move(d);
    }

    std::vector<Vec3d> scaledA_, scaledB_;
    std::span<const Vec3d> a_, b_;
    Unit unit_;
    std::vector<Corner> corners_;
    std::vector<double> weights_;
    bool gaveUp_ = false;
    std::optional<Vector<Number>> direction_;  ///< to the nearest point of the simplex; none: that is the origin
};

}  // namespace

ExactDescent descendExactly(std::span<const Vec3d> a, std::span<const Vec3d> b, std::span<const VertexPair> hints,
                            bool nearest) {
    const Reach reach = reachOf(a, b);
    // Heights are of the highest degree of all that is computed.
    constexpr int kDegree = 8,
                  kLeastBit = std::numeric_limits<double>::min_exponent - std::numeric_limits<double>::digits;
    const bool sums = kDegree * (reach.bottom - reach.top) > kLeastBit;
    if (sums) return Descent<Sum>(a, b, -reach.top, {}).run(hints, nearest);
    return Descent<Whole>(a, b, -reach.top, {reach.bottom}).run(hints, nearest);
}

}  // namespace tessera
