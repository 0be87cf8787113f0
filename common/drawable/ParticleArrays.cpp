#include "common/drawable/ParticleArrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "common/cores/Geometry.h"

namespace tessera {
namespace {

constexpr std::size_t kMostRampStops = 65536;
constexpr std::size_t kPlaceBytes = 3 * sizeof(float);

const Particles& particlesOf(const void* core) {
    return *static_cast<const Particles*>(core);
}
std::size_t particleCount(const Particles& p) {
    return static_cast<std::size_t>(p.positions.sizeBytes() / kPlaceBytes);
}
bool haveTails(const Particles& p) {
    return p.mode == Particles::kLines;
}
bool haveTurns(const Particles& p) {
    return p.mode == Particles::kQuads;
}

bool particlesAreHere(const Particles& p) {
    const auto here = [](const Blob& blob) { return blob.empty() || blob.resident(); };
    return here(p.positions) && (!haveTails(p) || here(p.tails)) && here(p.colors) && here(p.sizes) && here(p.ages) &&
           (!haveTurns(p) || here(p.turns)) && here(p.ageColors) && here(p.ageSizes);
}

tl::unexpected<Error> badParticles(std::string why) {
    return fail(ErrorCode::kBadInput, std::move(why));
}

struct NumberBounds {
    double least = 0, most = 0;  ///< both included
    std::string_view words;
};
constexpr double kUtmostFloat = std::numeric_limits<float>::max();
constexpr NumberBounds kFinite{-kUtmostFloat, kUtmostFloat, "has to be finite"};
constexpr NumberBounds kAnyNumber{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                                  "has to be a number"};
constexpr NumberBounds kSizes{0, kGreatestParticleSize, "has to be from 0 to 1e12"};

Expected<void> checkNumbers(std::span<const float> numbers, std::size_t first, std::size_t each, std::string_view name,
                            const NumberBounds& bounds) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const double number = static_cast<double>(numbers[i]);
        if (!(number >= bounds.least && number <= bounds.most))
            return badParticles(
                fmt::format("{} of particle {} is {}: it {}", name, first + i / each, number, bounds.words));
    }
    return {};
}

Expected<void> checkRamp(const Blob& blob, std::string_view name) {
    if (blob.sizeBytes() % 4 != 0)
        return badParticles(
            fmt::format("{} has {} bytes, no whole number of stops of 4 bytes", name, blob.sizeBytes()));
    if (blob.sizeBytes() / 4 > kMostRampStops)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} has {} stops, at most {} are allowed", name, blob.sizeBytes() / 4, kMostRampStops));
    return {};
}

Expected<void> checkParticles(const void* core) {
    const Particles& p = particlesOf(core);
    if (!particlesAreHere(p)) return badParticles("an array of the particles is not here");
    if (p.positions.sizeBytes() % kPlaceBytes != 0)
        return badParticles(fmt::format("positions has {} bytes, no whole number of places of {} bytes",
                                        p.positions.sizeBytes(), kPlaceBytes));
    const std::size_t count = particleCount(p);
    if (count > kMostParticles)
        return fail(ErrorCode::kLimit, fmt::format("{} particles, at most {} are allowed", count, kMostParticles));
    struct Own {
        const Blob* blob;
        std::string_view name;
        std::size_t bytesEach;
        bool counts;
    };
    for (const Own& own :
         {Own{&p.tails, "tails", kPlaceBytes, haveTails(p)}, Own{&p.colors, "colors", 4, true},
          Own{&p.sizes, "sizes", 4, true}, Own{&p.ages, "ages", 4, true}, Own{&p.turns, "turns", 4, haveTurns(p)}})
        if (own.counts && !own.blob->empty() && own.blob->sizeBytes() != count * own.bytesEach)
            return badParticles(fmt::format("{} has {} bytes: {} particles have {} of {} each, or none at all",
                                            own.name, own.blob->sizeBytes(), count, count * own.bytesEach,
                                            own.bytesEach));
    if (haveTails(p) && count > 0 && p.tails.empty()) return badParticles("lines need tails, as many as positions");
    for (const auto& [blob, name] : {std::pair(&p.ageColors, "ageColors"), std::pair(&p.ageSizes, "ageSizes")})
        if (Expected<void> good = checkRamp(*blob, name); !good) return good;
    if (Expected<void> good = checkNumbers(p.positions.as<float>(), 0, 3, "the position", kFinite); !good) return good;
    if (haveTails(p))
        if (Expected<void> good = checkNumbers(p.tails.as<float>(), 0, 3, "the tail", kFinite); !good) return good;
    if (haveTurns(p))
        if (Expected<void> good = checkNumbers(p.turns.as<float>(), 0, 1, "the turn", kFinite); !good) return good;
    if (Expected<void> good = checkNumbers(p.sizes.as<float>(), 0, 1, "the size", kSizes); !good) return good;
    if (Expected<void> good = checkNumbers(p.ages.as<float>(), 0, 1, "the age", kAnyNumber); !good) return good;
    const std::span<const float> ramp = p.ageSizes.as<float>();
    for (std::size_t i = 0; i < ramp.size(); ++i)
        if (!(ramp[i] >= 0 && static_cast<double>(ramp[i]) <= kGreatestParticleSize))
            return badParticles(fmt::format("stop {} of ageSizes is {}: it {}", i, ramp[i], kSizes.words));
    return {};
}

Hash128 recipeOfParticles(const Particles& p) {
    const std::array<Hash128, 10> parts{Hash128{Particles::kType.value, static_cast<std::uint64_t>(p.mode)},
                                        Hash128{std::bit_cast<std::uint64_t>(p.size), p.sorted ? 1u : 0u},
                                        Hash128{p.positions.sizeBytes(), 0},
                                        haveTails(p) ? p.tails.id() : BlobId(),
                                        p.colors.id(),
                                        p.sizes.id(),
                                        p.ages.id(),
                                        haveTurns(p) ? p.turns.id() : BlobId(),
                                        p.ageColors.id(),
                                        p.ageSizes.id()};
    return hash128(std::as_bytes(std::span(parts)));
}

std::optional<DerivedSource> sourceOfParticles(const void* core, const Fineness&) {
    const Particles& p = particlesOf(core);
    if (p.positions.empty() || !particlesAreHere(p)) return std::nullopt;
    return DerivedSource{recipeOfParticles(p), p.positions};
}

/// Between two stops of a ramp.
struct RampPlace {
    std::size_t from = 0, to = 0;
    double share = 0;  ///< of `to`
};
RampPlace rampPlace(double age, std::size_t stops) {
    const double at = age * static_cast<double>(stops - 1);
    const std::size_t from = std::min(static_cast<std::size_t>(at), stops - 1);
    return {from, std::min(from + 1, stops - 1), at - static_cast<double>(from)};
}

/// What each is like now.
class ParticleLooks {
public:
    explicit ParticleLooks(const Particles& p)
        : size_(p.size),
          mostSize_(haveTails(p) ? Geometry::kWidestLinePx : kGreatestParticleSize),
          sizes_(p.sizes.as<float>()),
          ages_(p.ages.as<float>()),
          sizeRamp_(p.ageSizes.as<float>()),
          colors_(p.colors.as<std::uint8_t>()),
          colorRamp_(p.ageColors.as<std::uint8_t>()) {}

    [[nodiscard]] float size(std::size_t i) const {
        const double age = ageOf(i);
        if (!(age >= 0 && age <= 1)) return 0;
        double size = sizes_.empty() ? size_ : static_cast<double>(sizes_[i]);
        if (!sizeRamp_.empty()) {
            const RampPlace at = rampPlace(age, sizeRamp_.size());
            const double from = static_cast<double>(sizeRamp_[at.from]), to = static_cast<double>(sizeRamp_[at.to]);
            size *= from + (to - from) * at.share;
        }
        return static_cast<float>(std::min(size, mostSize_));
    }
    [[nodiscard]] bool anyColors() const { return !colors_.empty() || colorRamp_.size() >= 4; }
    [[nodiscard]] std::array<std::uint8_t, 4> color(std::size_t i) const {
        std::array<std::uint8_t, 4> own{255, 255, 255, 255};
        if (!colors_.empty()) std::copy_n(&colors_[4 * i], 4, own.begin());
        const double age = ageOf(i);
        if (colorRamp_.size() < 4 || !(age >= 0 && age <= 1)) return own;
        const RampPlace at = rampPlace(age, colorRamp_.size() / 4);
        const auto share = static_cast<unsigned>(at.share * 256);
        for (std::size_t k = 0; k < 4; ++k) {
            const unsigned ramp =
                colorRamp_[4 * at.from + k] * (256 - share) + colorRamp_[4 * at.to + k] * share;  // of 256 × 255
            own[k] = static_cast<std::uint8_t>((own[k] * ramp + 127 * 256) / (255 * 256));
        }
        return own;
    }

private:
    [[nodiscard]] double ageOf(std::size_t i) const { return ages_.empty() ? 0.0 : static_cast<double>(ages_[i]); }

    double size_, mostSize_;
    std::span<const float> sizes_, ages_, sizeRamp_;
    std::span<const std::uint8_t> colors_, colorRamp_;
};

/// Places of some particles, as the arrays of lines have them or as they are.
std::vector<float> placesOf(const Particles& p, std::size_t first, std::size_t end) {
    const std::span<const float> heads = p.positions.as<float>(), tails = p.tails.as<float>();
    if (!haveTails(p))
        return {heads.begin() + static_cast<std::ptrdiff_t>(3 * first),
                heads.begin() + static_cast<std::ptrdiff_t>(3 * end)};
    std::vector<float> both;
    both.reserve(6 * (end - first));
    for (std::size_t i = first; i < end; ++i)
        for (const auto& from : {tails, heads})
            both.insert(both.end(), {from[3 * i], from[3 * i + 1], from[3 * i + 2]});
    return both;
}

DerivedMesh movedParticles(const Particles& p, const EarlierMesh& earlier) {
    const ByteRange range = elementsOf(earlier.changed, kPlaceBytes);
    const std::size_t first = range.begin, end = std::min<std::size_t>(range.end, particleCount(p));
    DerivedMesh out{.arrays = earlier.mesh.arrays, .plan = nullptr};
    if (first >= end) return out;
    if (!checkNumbers(p.positions.as<float>().subspan(3 * first, 3 * (end - first)), first, 3, "the position", kFinite))
        return {};
    const std::vector<float> places = placesOf(p, first, end);
    const std::size_t bytesEach = kPlaceBytes * (haveTails(p) ? 2 : 1);
    Expected<Blob> moved =
        out.arrays.positions.withRange(bytesEach * first, std::as_bytes(std::span<const float>(places)));
    if (!moved) return {};
    out.arrays.positions = std::move(*moved);
    return out;
}

DerivedMesh deriveParticles(const void* core, const Fineness&, const EarlierMesh* earlier) {
    const Particles& p = particlesOf(core);
    if (earlier) return movedParticles(p, *earlier);
    if (!checkParticles(core)) return {};
    const std::size_t count = particleCount(p), places = haveTails(p) ? 2 : 1;
    const ParticleLooks looks(p);
    std::vector<float> sizes;
    std::vector<std::uint8_t> colors;
    sizes.reserve(2 * places * count);
    if (looks.anyColors()) colors.reserve(4 * places * count);
    float greatest = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const float size = looks.size(i);
        greatest = std::max(greatest, size);
        for (std::size_t k = 0; k < places; ++k) sizes.insert(sizes.end(), {size, 0.0F});
        if (!looks.anyColors()) continue;
        const std::array<std::uint8_t, 4> color = looks.color(i);
        for (std::size_t k = 0; k < places; ++k) colors.insert(colors.end(), color.begin(), color.end());
    }
    DerivedMesh out;
    const std::vector<float> positions = placesOf(p, 0, count);
    out.arrays.kind = haveTails(p) ? MeshKind::kStreaks : haveTurns(p) ? MeshKind::kSprites : MeshKind::kDiscs;
    out.arrays.sorted = p.sorted;
    out.arrays.positions = Blob::of(std::span<const float>(positions));
    out.arrays.texcoords = Blob::of(std::span<const float>(sizes));
    if (!colors.empty()) out.arrays.colors = Blob::of(std::span<const std::uint8_t>(colors));
    if (haveTails(p)) {
        std::vector<std::uint32_t> lines(2 * count);
        for (std::size_t i = 0; i < lines.size(); ++i) lines[i] = static_cast<std::uint32_t>(i);
        out.arrays.lines = Blob::of(std::span<const std::uint32_t>(lines));
        out.arrays.lineWidth = greatest;
    } else {
        // Half the side of a quad's square, times the root of two and the rounding of what a shader makes of it.
        out.arrays.pointRadius = static_cast<double>(greatest) * (haveTurns(p) ? 0.7072 : 0.50001);
    }
    if (haveTurns(p)) {
        const std::span<const float> turns = p.turns.as<float>();
        std::vector<float> sides;
        sides.reserve(2 * count);
        for (std::size_t i = 0; i < count; ++i) {
            const double turn = turns.empty() ? 0.0 : static_cast<double>(turns[i]);
            sides.insert(sides.end(), {static_cast<float>(std::cos(turn)), static_cast<float>(std::sin(turn))});
        }
        out.arrays.texcoords1 = Blob::of(std::span<const float>(sides));
    }
    return out;
}

}  // namespace

constinit const Derivation kParticleDerivation{
    .check = &checkParticles,
    .source = &sourceOfParticles,
    .derive = &deriveParticles,
    .resident = [](const void* core) { return particlesAreHere(particlesOf(core)); },
};

}  // namespace tessera
