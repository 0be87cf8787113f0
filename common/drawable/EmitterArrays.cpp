#include "common/drawable/EmitterArrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "common/drawable/ParticleArrays.h"

namespace tessera {
namespace {

const ParticleEmitter& emitterOf(const void* core) {
    return *static_cast<const ParticleEmitter*>(core);
}

/// Of SplitMix64 (G. Steele et al., "Fast Splittable Pseudorandom Number Generators", 2014): a number for each number.
std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ z >> 27) * 0x94D049BB133111EBull;
    return z ^ z >> 31;
}

/// The random numbers of one particle, one after the other.
class Chances {
public:
    Chances(std::int64_t seed, std::uint64_t particle)
        : state_(mixed(mixed(static_cast<std::uint64_t>(seed) + kStep) ^ particle * kStep)) {}
    /// From 0 to below 1.
    double next() { return static_cast<double>(mixed(state_ += kStep) >> 11) * 0x1p-53; }
    double between(double low, double high) { return low + (high - low) * next(); }

private:
    static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15ull;
    std::uint64_t state_;
};

/// Within the ball, or disc, of radius 1, and not at its middle. By rejection: the first of some tries that is; that is
/// all but certain.
template <int kDimensions>
Eigen::Matrix<double, kDimensions, 1> inBall(Chances& chances) {
    Eigen::Matrix<double, kDimensions, 1> v;
    for (int i = 0; i < 64; ++i) {
        for (int k = 0; k < kDimensions; ++k) v[k] = chances.between(-1, 1);
        if (const double square = v.squaredNorm(); square <= 1 && square > 1e-12) return v;
    }
    return Eigen::Matrix<double, kDimensions, 1>::Unit(0);
}

/// e^-x for x >= 0: the Taylor series where x is small, squared as often as it was halved.
double decay(double x) {
    if (x > 700) return 0;
    int halvings = 0;
    for (; x > 0.125; x /= 2) ++halvings;
    double sum = 1;
    for (int k = 11; k > 0; --k) sum = 1 - x * sum / k;
    for (; halvings > 0; --halvings) sum *= sum;
    return sum;
}

/// For angles from 0 to π: 1 - 2 sin²(angle / 2).
double cosine(double angle) {
    const double x = angle / 2, square = x * x;
    double sum = 1;
    for (int k = 12; k > 0; --k) sum = 1 - square * sum / (2 * k * (2 * k + 1));
    const double sine = x * sum;
    return 1 - 2 * sine * sine;
}

/// E and F of EmitterArrays.h.
struct Flight {
    double ofVelocity = 0, ofAcceleration = 0;
};
Flight flightAt(double t, double drag) {
    const double x = drag * t;
    if (x > 0.125) {
        const double e = (1 - decay(x)) / drag;
        return {e, (t - e) / drag};
    }
    // E = t (1 - x/2 + x²/6 - …), F = t² (1/2 - x/6 + x²/24 - …): no difference of what is nearly equal.
    double e = 1, f = 1;
    for (int k = 12; k > 1; --k) e = 1 - x * e / k;
    for (int k = 12; k > 2; --k) f = 1 - x * f / k;
    return {t * e, t * t * f / 2};
}

/// What is the same for all particles.
struct Stream {
    explicit Stream(const ParticleEmitter& emitter)
        : of(emitter), axis(emitter.direction / emitter.direction.norm()), cosSpread(cosine(emitter.directionSpread)) {
        // Two that stand on the axis and on each other, by the axis of coordinates that is farthest from it.
        Eigen::Index least = 0;
        axis.cwiseAbs().minCoeff(&least);
        side = axis.cross(Vec3d::Unit(least));
        side /= side.norm();
        up = axis.cross(side);
    }

    /// Particles that may be there: from `first` to below `end`.
    struct Numbers {
        std::uint64_t first = 0, end = 0;
    };
    [[nodiscard]] Numbers numbers() const {
        if (of.rate <= 0 || of.life <= 0) return {};
        const double last = std::floor(of.time * of.rate),
                     first = std::max(0.0, std::floor((of.time - of.life) * of.rate));
        return {static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(last) + 1};
    }

    [[nodiscard]] Vec3d placeOf(Chances& chances) const {
        const Vec3d half = of.extent / 2;
        switch (of.place) {
            case ParticleEmitter::kBox: {
                Vec3d p;
                for (int i = 0; i < 3; ++i) p[i] = chances.between(-1, 1);
                return p.cwiseProduct(half);
            }
            case ParticleEmitter::kSphere:
                return inBall<3>(chances).cwiseProduct(half);
            case ParticleEmitter::kDisc: {
                const Vec2d p = inBall<2>(chances);
                return {p.x() * half.x(), 0, p.y() * half.z()};
            }
            default:
                return Vec3d::Zero();
        }
    }

    [[nodiscard]] Vec3d velocityOf(Chances& chances) const {
        const double along = chances.between(cosSpread, 1), across = std::sqrt(std::max(0.0, 1 - along * along));
        Vec2d around = inBall<2>(chances);
        around /= around.norm();
        const double pace = of.pace * (1 + of.paceSpread * chances.between(-1, 1));
        return pace * (along * axis + across * (around.x() * side + around.y() * up));
    }

    /// Around all directions that there may be, on one axis of coordinates.
    [[nodiscard]] std::pair<double, double> directionsAlong(Eigen::Index i) const {
        const double d = axis[i],
                     turned = std::sqrt(std::max(0.0, 1 - d * d)) * std::sqrt(std::max(0.0, 1 - cosSpread * cosSpread));
        return {-d >= cosSpread ? -1 : d * cosSpread - turned, d >= cosSpread ? 1 : d * cosSpread + turned};
    }

    const ParticleEmitter& of;
    Vec3d axis, side, up;
    double cosSpread;
};

Expected<void> checkEmitter(const void* core) {
    const ParticleEmitter& e = emitterOf(core);
    if (const double live = e.rate * e.life; live > ParticleEmitter::kMostLive)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} births per s that live {} s are {} particles at a time, at most {} are allowed",
                                e.rate, e.life, live, ParticleEmitter::kMostLive));
    if (!(e.direction.squaredNorm() > 1e-24))
        return fail(ErrorCode::kBadInput, "its direction is no direction: it is zero");
    return {};
}

std::optional<DerivedSource> sourceOfEmitter(const void* core, const Fineness&) {
    const ParticleEmitter& e = emitterOf(core);
    if (e.rate <= 0 || e.life <= 0) return std::nullopt;
    std::vector<std::uint64_t> all{ParticleEmitter::kType.value, std::bit_cast<std::uint64_t>(e.seed),
                                   static_cast<std::uint64_t>(e.place), static_cast<std::uint64_t>(e.mode),
                                   e.sorted ? 1u : 0u};
    const auto add = [&](double number) { all.push_back(std::bit_cast<std::uint64_t>(number)); };
    for (const double number : {e.time, e.rate, e.life, e.lifeSpread, e.directionSpread, e.pace, e.paceSpread, e.drag,
                                e.beginSize, e.endSize, e.streak})
        add(number);
    for (const Vec3d& vector : {e.extent, e.direction, e.acceleration})
        for (const double number : vector) add(number);
    for (const Vec4f& color : {e.beginColor, e.endColor})
        for (const float number : color) add(static_cast<double>(number));
    return DerivedSource{hash128(std::as_bytes(std::span(all))), Blob()};
}

template <typename Number>
Blob blobOf(const std::vector<Number>& numbers) {
    return numbers.empty() ? Blob() : Blob::of(std::span<const Number>(numbers));
}

/// As Particles, whose drawing is theirs.
Particles particlesNow(const ParticleEmitter& e) {
    const Stream stream(e);
    std::vector<float> positions, tails, ages, turns;
    const auto add = [](std::vector<float>& to, const Vec3d& p) {
        for (const double number : p) to.push_back(static_cast<float>(number));
    };
    const Stream::Numbers numbers = stream.numbers();
    for (std::uint64_t n = numbers.first; n < numbers.end; ++n) {
        Chances chances(e.seed, n);
        const double age = e.time - static_cast<double>(n) / e.rate,
                     life = e.life * (1 - e.lifeSpread * chances.next());
        if (!(age >= 0 && age < life)) continue;
        const Vec3d place = stream.placeOf(chances), velocity = stream.velocityOf(chances);
        const auto at = [&](double t) {
            const Flight flight = flightAt(t, e.drag);
            return Vec3d(place + flight.ofVelocity * velocity + flight.ofAcceleration * e.acceleration);
        };
        add(positions, at(age));
        ages.push_back(static_cast<float>(age / life));
        if (e.mode == ParticleEmitter::kLines) add(tails, at(std::max(0.0, age - e.streak)));
        if (e.mode == ParticleEmitter::kQuads)
            turns.push_back(static_cast<float>(chances.between(0, 2 * std::numbers::pi)));
    }
    std::vector<std::uint8_t> colors;
    for (const Vec4f& color : {e.beginColor, e.endColor})
        for (const float share : color) colors.push_back(static_cast<std::uint8_t>(share * 255 + 0.5F));
    const std::vector<float> sizes{static_cast<float>(e.beginSize), static_cast<float>(e.endSize)};
    Particles now;
    now.positions = blobOf(positions);
    now.tails = blobOf(tails);
    now.ages = blobOf(ages);
    now.turns = blobOf(turns);
    now.ageColors = blobOf(colors);
    now.ageSizes = blobOf(sizes);
    now.mode = e.mode;
    now.size = 1;
    now.sorted = e.sorted;
    return now;
}
static_assert(ParticleEmitter::kPoints == Particles::kPoints && ParticleEmitter::kLines == Particles::kLines &&
              ParticleEmitter::kQuads == Particles::kQuads);

DerivedMesh deriveEmitter(const void* core, const Fineness& fineness, const EarlierMesh*) {
    if (!checkEmitter(core)) return {};
    const Particles now = particlesNow(emitterOf(core));
    return now.positions.empty() ? DerivedMesh() : kParticleDerivation.derive(&now, fineness, nullptr);
}

Box boundsOfEmitter(const void* core) {
    const ParticleEmitter& e = emitterOf(core);
    if (e.rate <= 0 || e.life <= 0 || !checkEmitter(core)) return {};
    const Stream stream(e);
    const Flight last = flightAt(e.life, e.drag);
    Box box{Vec3d::Zero(), Vec3d::Zero()};
    for (Eigen::Index i = 0; i < 3; ++i) {
        const double half =
            e.place == ParticleEmitter::kPoint || (e.place == ParticleEmitter::kDisc && i == 1) ? 0 : e.extent[i] / 2;
        const auto [least, most] = stream.directionsAlong(i);
        const double pace = e.pace * (1 + e.paceSpread) * last.ofVelocity,
                     fall = e.acceleration[i] * last.ofAcceleration;
        box.lower[i] = -half + pace * std::min(0.0, least) + std::min(0.0, fall);
        box.upper[i] = half + pace * std::max(0.0, most) + std::max(0.0, fall);
    }
    // As far as anything is drawn around its place (lines are pixels wide), and what is rounded to floats on the way.
    const double size = e.mode == ParticleEmitter::kLines
                            ? 0
                            : std::max(e.beginSize, e.endSize) * (e.mode == ParticleEmitter::kQuads ? 0.7072 : 0.50001);
    const double reach = size + 1e-6 * (size + box.lower.cwiseAbs().maxCoeff() + box.upper.cwiseAbs().maxCoeff());
    box.lower.array() -= reach;
    box.upper.array() += reach;
    return box;
}

}  // namespace

constinit const Derivation kEmitterDerivation{
    .check = &checkEmitter,
    .source = &sourceOfEmitter,
    .derive = &deriveEmitter,
    .resident = [](const void*) { return true; },
    .bounds = &boundsOfEmitter,
    .meetsNobody = true,
};

}  // namespace tessera
