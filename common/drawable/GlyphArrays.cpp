#include "common/drawable/GlyphArrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/drawable/VolumeArrays.h"
#include "common/geometry/MeshCopies.h"

namespace tessera {
namespace {

constexpr std::size_t kGlyphPlaceBytes = 3 * sizeof(float);
constexpr std::size_t kGlyphTurnBytes = 4 * sizeof(float);
constexpr std::size_t kTrianglesPerGlyphBox = 12;
/// What a copy's scale may be: what a Geometry's points may have as radius.
constexpr double kGreatestGlyph = 1e12;

const Glyphs& glyphsOf(const void* core) {
    return *static_cast<const Glyphs*>(core);
}
std::size_t glyphCount(const Glyphs& g) {
    return static_cast<std::size_t>(g.positions.sizeBytes() / kGlyphPlaceBytes);
}
std::array<const Blob*, 10> arraysOfGlyphs(const Glyphs& g) {
    return {&g.positions,      &g.vectors,      &g.scalars,      &g.colors, &g.transfer,
            &g.shapePositions, &g.shapeNormals, &g.shapeIndices, &g.turns,  &g.shapeTexcoords};
}
bool glyphsAreHere(const Glyphs& g) {
    return std::ranges::all_of(arraysOfGlyphs(g), [](const Blob* blob) { return blob->empty() || blob->resident(); });
}

tl::unexpected<Error> badGlyphs(std::string why) {
    return fail(ErrorCode::kBadInput, std::move(why));
}

// ---- shapes ---------------------------------------------------------------------------------------------------------

/// Along Y from 0 to 1: a shaft, and a head with a flat back.
MeshData makeArrow() {
    constexpr unsigned kSides = 8;
    constexpr double kShaft = 0.035, kHead = 0.1, kNeck = 0.65;
    MeshData arrow;
    const auto addVertex = [&](const Vec3d& at, const Vec3d& normal) {
        for (int axis = 0; axis < 3; ++axis) arrow.positions.push_back(static_cast<float>(at[axis]));
        for (int axis = 0; axis < 3; ++axis) arrow.normals.push_back(static_cast<float>(normal[axis]));
        return static_cast<std::uint32_t>(arrow.positions.size() / 3 - 1);
    };
    const auto outwards = [](double side) {
        const double angle = 2 * std::numbers::pi * side / kSides;
        return Vec3d(std::cos(angle), 0, -std::sin(angle));
    };
    // Two rings, the upper one second, joined by a band that faces outwards.
    const auto addBand = [&](double lowerRadius, double lowerY, double upperRadius, double upperY, auto&& normalAt) {
        std::vector<std::array<std::uint32_t, 2>> ring;
        for (unsigned i = 0; i < kSides; ++i)
            ring.push_back({addVertex(lowerRadius * outwards(i) + lowerY * Vec3d::UnitY(), normalAt(i, false)),
                            addVertex(upperRadius * outwards(upperRadius > 0 ? i : i + 0.5) + upperY * Vec3d::UnitY(),
                                      normalAt(i, true))});
        for (unsigned i = 0; i < kSides; ++i) {
            const auto& [a, c] = ring[i];
            const auto& [b, d] = ring[(i + 1) % kSides];
            arrow.indices.insert(arrow.indices.end(), {a, b, c});
            if (upperRadius > 0) arrow.indices.insert(arrow.indices.end(), {b, d, c});
        }
    };
    const auto flat = [&](unsigned, bool) { return Vec3d(-Vec3d::UnitY()); };
    const double slant = kHead / (1 - kNeck);
    addBand(kShaft, 0, kShaft, kNeck, [&](unsigned i, bool) { return outwards(i); });
    addBand(kHead, kNeck, 0, 1, [&](unsigned i, bool tip) {
        return Vec3d((outwards(i + (tip ? 0.5 : 0.0)) + slant * Vec3d::UnitY()).normalized());
    });
    addBand(kShaft, kNeck, kHead, kNeck, flat);
    // The shaft's end.
    std::vector<std::uint32_t> end;
    for (unsigned i = 0; i < kSides; ++i) end.push_back(addVertex(kShaft * outwards(i), -Vec3d::UnitY()));
    for (unsigned i = 2; i < kSides; ++i) arrow.indices.insert(arrow.indices.end(), {end[0], end[i], end[i - 1]});
    return arrow;
}

/// Without the arrays of its copies.
MeshArrays shapeOfGlyphs(const Glyphs& g) {
    const auto made = [](MeshData shape) {
        shape.texcoords.clear();
        return shape.toArrays();
    };
    static const MeshArrays kArrow = made(makeArrow()), kBox = made(makeBox(Vec3d::Ones())),
                            kBall = made(makeSphere(0.5, 12));
    switch (g.shape) {
        case Glyphs::kBox:
            return kBox;
        case Glyphs::kBall:
            return kBall;
        case Glyphs::kMesh:
            return {.positions = g.shapePositions,
                    .normals = g.shapeNormals,
                    .texcoords = g.shapeTexcoords,
                    .indices = g.shapeIndices};
        default:
            return kArrow;
    }
}

// ---- what is refused ------------------------------------------------------------------------------------------------

Expected<void> checkGlyphNumbers(std::span<const float> numbers, std::size_t each, std::string_view name) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
        if (!(std::abs(numbers[i]) <= 1e30F))
            return badGlyphs(
                fmt::format("{} of glyph {} is {}: it has to be from -1e30 to 1e30", name, i / each, numbers[i]));
    return {};
}

Expected<void> checkShape(const Glyphs& g, std::size_t count) {
    const MeshArrays shape = shapeOfGlyphs(g);
    if (g.shape == Glyphs::kMesh) {
        const MeshLimits limits{.maxVertices = kMostShapeVertices, .maxTriangles = kMostShapeTriangles};
        if (Expected<void> sound = checkMesh(shape, limits); !sound) return failWith("the shape", sound.error());
        if (count > 0 && shape.indices.empty()) return badGlyphs("shape mesh needs shapePositions and shapeIndices");
    }
    const std::uint64_t each = triangleCount(shape), most = MeshLimits().maxTriangles;
    if (each * count > most)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} glyphs of {} triangles, at most {} triangles are allowed", count, each, most));
    return {};
}

Expected<void> checkGlyphs(const void* core) {
    const Glyphs& g = glyphsOf(core);
    if (!glyphsAreHere(g)) return badGlyphs("arrays of the glyphs are not here");
    if (g.positions.sizeBytes() % kGlyphPlaceBytes != 0)
        return badGlyphs(fmt::format("positions has {} bytes, no whole number of places of {} bytes",
                                     g.positions.sizeBytes(), kGlyphPlaceBytes));
    const std::size_t count = glyphCount(g);
    if (count > kMostGlyphs)
        return fail(ErrorCode::kLimit, fmt::format("{} glyphs, at most {} are allowed", count, kMostGlyphs));
    struct Own {
        const Blob* blob;
        std::string_view name;
        std::size_t bytesEach;
    };
    for (const Own& own : {Own{&g.vectors, "vectors", kGlyphPlaceBytes}, Own{&g.scalars, "scalars", sizeof(float)},
                           Own{&g.colors, "colors", 4}, Own{&g.turns, "turns", kGlyphTurnBytes}})
        if (!own.blob->empty() && own.blob->sizeBytes() != count * own.bytesEach)
            return badGlyphs(fmt::format("{} has {} bytes: {} glyphs have {} of {} each, or none at all", own.name,
                                         own.blob->sizeBytes(), count, count * own.bytesEach, own.bytesEach));
    if (g.transfer.sizeBytes() % 4 != 0 || g.transfer.sizeBytes() / 4 > kMostTransferStops)
        return badGlyphs(fmt::format("transfer has {} bytes: up to {} stops of 4 bytes", g.transfer.sizeBytes(),
                                     kMostTransferStops));
    if (!(g.low < g.high))
        return badGlyphs(fmt::format("low is {} and high {}: colours need low below high", g.low, g.high));
    if (Expected<void> good = checkGlyphNumbers(g.positions.as<float>(), 3, "the position"); !good) return good;
    if (Expected<void> good = checkGlyphNumbers(g.vectors.as<float>(), 3, "the vector"); !good) return good;
    if (Expected<void> good = checkGlyphNumbers(g.scalars.as<float>(), 1, "the scalar"); !good) return good;
    if (Expected<void> good = checkGlyphNumbers(g.turns.as<float>(), 4, "the turn"); !good) return good;
    const std::span<const float> turns = g.turns.as<float>();
    for (std::size_t i = 0; i + 4 <= turns.size(); i += 4)
        if (std::ranges::all_of(turns.subspan(i, 4), [](float part) { return part == 0; }))
            return badGlyphs(fmt::format("the turn of glyph {} is 0, 0, 0, 0, which is no turn", i / 4));
    return checkShape(g, count);
}

// ---- what is made ---------------------------------------------------------------------------------------------------

/// Where each is, how it is turned and scaled, what colour it has.
class GlyphLooks {
public:
    explicit GlyphLooks(const Glyphs& g)
        : glyphs_(g),
          places_(g.positions.as<float>()),
          vectors_(g.vectors.as<float>()),
          scalars_(g.scalars.as<float>()),
          turns_(g.turns.as<float>()),
          colors_(g.colors.as<std::uint8_t>()),
          stops_(g.transfer.as<std::uint8_t>()) {}

    [[nodiscard]] Vec3f place(std::size_t i) const { return {places_[3 * i], places_[3 * i + 1], places_[3 * i + 2]}; }
    [[nodiscard]] MeshCopy copy(std::size_t i) const {
        const Vec3d vector = vectorOf(i);
        const double norm = vector.norm();
        MeshCopy copy{.place = {places_[3 * i], places_[3 * i + 1], places_[3 * i + 2]},
                      .width = scale(glyphs_.widthBy, i, norm),
                      .length = scale(glyphs_.lengthBy, i, norm)};
        if (!turns_.empty())
            copy.turn = turnOf(i);
        else if (norm > 0)
            copy.turn = turnTo(vector / norm);
        if (copy.width == 0 || copy.length == 0) copy.width = copy.length = 0;
        return copy;
    }
    [[nodiscard]] bool anyColors() const { return !colors_.empty() || mapped(); }
    [[nodiscard]] std::array<std::uint8_t, 4> color(std::size_t i) const {
        std::array<std::uint8_t, 4> color{255, 255, 255, 255};
        if (!colors_.empty()) std::copy_n(&colors_[4 * i], 4, color.begin());
        if (!mapped()) return color;
        const std::size_t stops = stops_.size() / 4;
        const double value = number(glyphs_.colorBy, i, vectorOf(i).norm());
        const double place =
            std::clamp((value - glyphs_.low) / (glyphs_.high - glyphs_.low), 0.0, 1.0) * static_cast<double>(stops - 1);
        const auto from = static_cast<std::size_t>(place);
        const std::size_t to = std::min(from + 1, stops - 1);
        const auto share = static_cast<unsigned>((place - static_cast<double>(from)) * 256);
        for (std::size_t k = 0; k < 4; ++k) {
            const unsigned stop = stops_[4 * from + k] * (256 - share) + stops_[4 * to + k] * share;  // of 256 × 255
            color[k] = static_cast<std::uint8_t>((color[k] * stop + 127 * 256) / (255 * 256));
        }
        return color;
    }

private:
    [[nodiscard]] bool mapped() const {
        const bool any = glyphs_.colorBy == Glyphs::kScalar   ? !scalars_.empty()
                         : glyphs_.colorBy == Glyphs::kVector ? !vectors_.empty()
                                                              : false;
        return any && !stops_.empty();
    }
    [[nodiscard]] Vec3d vectorOf(std::size_t i) const {
        if (vectors_.empty()) return Vec3d::Zero();
        return Vec3f(vectors_[3 * i], vectors_[3 * i + 1], vectors_[3 * i + 2]).cast<double>();
    }
    /// What a field that follows something follows; 1 where there is nothing.
    [[nodiscard]] double number(std::int64_t by, std::size_t i, double norm) const {
        if (by == Glyphs::kVector && !vectors_.empty()) return norm;
        if (by == Glyphs::kScalar && !scalars_.empty()) return static_cast<double>(scalars_[i]);
        return 1;
    }
    [[nodiscard]] float scale(std::int64_t by, std::size_t i, double norm) const {
        return static_cast<float>(std::clamp(glyphs_.size * number(by, i, norm), 0.0, kGreatestGlyph));
    }
    [[nodiscard]] std::array<float, 4> turnOf(std::size_t i) const {
        const std::span<const float, 4> said(&turns_[4 * i], 4);
        double squares = 0;
        for (const float part : said) squares += static_cast<double>(part) * static_cast<double>(part);
        std::array<float, 4> turn{};
        // What is as near to 1 as single precision can be stays: written and read again it is the same.
        const double norm = std::abs(squares - 1) < 1e-6 ? 1 : std::sqrt(squares);
        std::ranges::transform(said, turn.begin(), [&](float part) { return static_cast<float>(part / norm); });
        return turn;
    }
    /// The shortest turn from +Y to that direction; square roots alone, which processors agree on.
    [[nodiscard]] static std::array<float, 4> turnTo(const Vec3d& direction) {
        const double w = std::sqrt(std::max(0.0, (1 + direction.y()) / 2));
        if (w < 1e-7) return {1, 0, 0, 0};
        return {static_cast<float>(direction.z() / (2 * w)), 0, static_cast<float>(-direction.x() / (2 * w)),
                static_cast<float>(w)};
    }

    const Glyphs& glyphs_;
    std::span<const float> places_, vectors_, scalars_, turns_;
    std::span<const std::uint8_t> colors_, stops_;
};

/// Ten bits for each axis of the box around them, taken in turn (Morton 1966); equal ones as they come.
std::vector<std::uint32_t> nearOrder(const GlyphLooks& looks, std::size_t count) {
    Vec3f lower = Vec3f::Constant(std::numeric_limits<float>::max()), upper = -lower;
    for (std::size_t i = 0; i < count; ++i) {
        lower = lower.cwiseMin(looks.place(i));
        upper = upper.cwiseMax(looks.place(i));
    }
    const Vec3d from = lower.cast<double>(), size = upper.cast<double>() - from;
    const auto spread = [](std::uint32_t bits) {
        std::uint32_t out = 0;
        for (unsigned bit = 0; bit < 10; ++bit) out |= (bits >> bit & 1u) << (3 * bit);
        return out;
    };
    std::vector<std::uint32_t> codes(count), order(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3d at = looks.place(i).cast<double>() - from;
        for (int axis = 0; axis < 3; ++axis)
            if (size[axis] > 0) codes[i] |= spread(static_cast<std::uint32_t>(at[axis] / size[axis] * 1023)) << axis;
    }
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return codes[i]; });
    return order;
}

MeshArrays glyphsOnScreens(const Glyphs& g) {
    const GlyphLooks looks(g);
    const std::vector<std::uint32_t> order = nearOrder(looks, glyphCount(g));
    std::vector<MeshCopy> copies;
    std::vector<std::uint8_t> colors;
    copies.reserve(order.size());
    for (const std::uint32_t i : order) {
        copies.push_back(looks.copy(i));
        if (!looks.anyColors()) continue;
        const std::array<std::uint8_t, 4> color = looks.color(i);
        colors.insert(colors.end(), color.begin(), color.end());
    }
    MeshArrays arrays = shapeOfGlyphs(g);
    arrays.kind = MeshKind::kGlyphs;
    arrays.copies = Blob::of(std::span<const MeshCopy>(copies));
    if (!colors.empty()) arrays.colors = Blob::of(std::span<const std::uint8_t>(colors));
    return arrays;
}

MeshArrays boxesOfGlyphs(const Glyphs& g) {
    // Of the corners as cornersOfCopy numbers them, outwards.
    static constexpr std::array<std::uint32_t, 3 * kTrianglesPerGlyphBox> kCorners = {
        0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
    const GlyphLooks looks(g);
    const std::size_t count = glyphCount(g);
    const Box shape = boundsOf(shapeOfGlyphs(g).positions.as<float>());
    MeshData boxes;
    boxes.positions.reserve(8 * 3 * count);
    boxes.indices.reserve(kCorners.size() * count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto first = static_cast<std::uint32_t>(8 * i);
        for (const Vec3d& corner : cornersOfCopy(looks.copy(i), shape))
            for (int axis = 0; axis < 3; ++axis) boxes.positions.push_back(static_cast<float>(corner[axis]));
        for (const std::uint32_t corner : kCorners) boxes.indices.push_back(first + corner);
    }
    return boxes.toArrays();
}

/// As that around all boxes: of what is rounded to them.
Box boundsOfGlyphs(const void* core) {
    const Glyphs& g = glyphsOf(core);
    Box bounds;
    if (!checkGlyphs(core)) return bounds;
    const GlyphLooks looks(g);
    const Box shape = boundsOf(shapeOfGlyphs(g).positions.as<float>());
    for (std::size_t i = 0; i < glyphCount(g); ++i)
        for (const Vec3d& corner : cornersOfCopy(looks.copy(i), shape))
            bounds.extend(corner.cast<float>().cast<double>());
    return bounds;
}

std::uint64_t trianglesOfGlyphs(const void* core) {
    const Glyphs& g = glyphsOf(core);
    return checkGlyphs(core) ? glyphCount(g) * triangleCount(shapeOfGlyphs(g)) : 0;
}

Hash128 recipeOfGlyphs(const Glyphs& g, const Fineness& fineness) {
    const auto bits = [](double number) { return std::bit_cast<std::uint64_t>(number); };
    std::vector<Hash128> parts{Hash128{Glyphs::kType.value, fineness.steps},
                               Hash128{static_cast<std::uint64_t>(g.shape), bits(g.size)},
                               Hash128{static_cast<std::uint64_t>(g.lengthBy), static_cast<std::uint64_t>(g.widthBy)},
                               Hash128{static_cast<std::uint64_t>(g.colorBy), bits(g.low)}, Hash128{bits(g.high), 0}};
    for (const Blob* blob : arraysOfGlyphs(g)) parts.push_back(blob->id());
    return hash128(std::as_bytes(std::span<const Hash128>(parts)));
}

std::optional<DerivedSource> sourceOfGlyphs(const void* core, const Fineness& fineness) {
    const Glyphs& g = glyphsOf(core);
    if (g.positions.empty() || !glyphsAreHere(g)) return std::nullopt;
    return DerivedSource{recipeOfGlyphs(g, fineness), {}};
}

DerivedMesh deriveGlyphs(const void* core, const Fineness& fineness, const EarlierMesh*) {
    const Glyphs& g = glyphsOf(core);
    if (!checkGlyphs(core)) return {};
    return {.arrays = fineness.steps == kGlyphsOnScreens ? glyphsOnScreens(g) : boxesOfGlyphs(g), .plan = nullptr};
}

}  // namespace

constinit const Derivation kGlyphDerivation{
    .check = &checkGlyphs,
    .source = &sourceOfGlyphs,
    .derive = &deriveGlyphs,
    .resident = [](const void* core) { return glyphsAreHere(glyphsOf(core)); },
    .bounds = &boundsOfGlyphs,
    .triangles = &trianglesOfGlyphs,
    .meetsNobody = true,
};

}  // namespace tessera
