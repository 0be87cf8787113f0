#include "common/drawable/TextArrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

#include "common/cores/Text.h"
#include "common/drawable/ContentCache.h"
#include "common/geometry/TextOutlines.h"

namespace tessera {
namespace {

constexpr std::size_t kMostTextTriangles = 4'000'000;
constexpr std::size_t kMostCutCorners = 500'000;  // of all shapes
constexpr unsigned kTextSteps = 3;
/// Sides of a rim that turns by less are one smooth surface.
constexpr double kSmoothCosine = 0.8;

const Text& textOf(const void* core) {
    return *static_cast<const Text*>(core);
}
bool isTextHere(const Text& text) {
    return text.outlines.empty() || text.outlines.resident();
}

/// Of 1/65536 em.
double chordTolerance(unsigned steps) {
    return std::ldexp(OutlinePoint::kPerEm / 512.0, -2 * static_cast<int>(steps));
}

/// The letters' shapes cut into triangles, or why they are not: shared by all sizes.
struct CutLetters {
    TextOutlines outlines;
    std::vector<LetterTriangles> shapes;
    Error wrong;
    bool sound = false;
    std::size_t triangles = 0;  ///< of fronts

    [[nodiscard]] std::size_t bytes() const {
        std::size_t sum = 256 + outlines.letters.size() * sizeof(PlacedLetter);
        for (const LetterTriangles& shape : shapes) sum += 24 * shape.vertices.size() + 4 * shape.triangles.size();
        return sum;
    }
    /// Whoever uses them holds them.
    [[nodiscard]] bool inUse() const { return false; }
};

CutLetters wrongLetters(Error wrong) {
    CutLetters letters;
    letters.wrong = std::move(wrong);
    return letters;
}

std::shared_ptr<const CutLetters> lettersOf(const Blob& outlines, unsigned steps) {
    static ContentCache<CutLetters> cache(std::size_t{1} << 25);
    const std::array<Hash128, 2> key{outlines.id(), Hash128{Text::kType.value, steps}};
    return cache.get(hash128(std::as_bytes(std::span(key))), [&]() -> CutLetters {
        Expected<TextOutlines> read = TextOutlines::of(outlines);
        if (!read) return wrongLetters(read.error());
        CutLetters letters;
        letters.outlines = std::move(*read);
        std::size_t corners = 0;
        for (const LetterShape& shape : letters.outlines.shapes) {
            Expected<LetterTriangles> cut = trianglesOf(shape, chordTolerance(steps));
            if (!cut) return wrongLetters(cut.error());
            letters.shapes.push_back(std::move(*cut));
            corners += letters.shapes.back().vertices.size();
            if (corners > kMostCutCorners)
                return wrongLetters(
                    {ErrorCode::kLimit, fmt::format("the letters' shapes have more than {} corners", kMostCutCorners)});
        }
        for (const PlacedLetter& letter : letters.outlines.letters)
            letters.triangles += letters.shapes[letter.shape].triangles.size() / 3;
        if (letters.triangles > kMostTextTriangles)
            return wrongLetters({ErrorCode::kLimit, fmt::format("the letters have {} triangles, at most {} are allowed",
                                                                letters.triangles, kMostTextTriangles)});
        letters.sound = true;
        return letters;
    });
}

Expected<void> checkText(const void* core) {
    const Text& text = textOf(core);
    if (text.outlines.empty()) return {};
    const std::shared_ptr<const CutLetters> letters = lettersOf(text.outlines, 0);
    if (!letters->sound) return tl::unexpected(letters->wrong);
    return {};
}

std::optional<DerivedSource> sourceOfText(const void* core, const Fineness& fineness) {
    const Text& text = textOf(core);
    if (text.outlines.empty() || !text.outlines.resident()) return std::nullopt;
    // Other outlines are another mesh, not the same one bent.
    const std::array<Hash128, 3> parts{
        Hash128{Text::kType.value, fineness.steps},
        Hash128{std::bit_cast<std::uint64_t>(text.size), std::bit_cast<std::uint64_t>(text.depth)}, text.outlines.id()};
    return DerivedSource{hash128(std::as_bytes(std::span(parts))), text.outlines};
}

/// Corners with normals of their own.
class LetterMesh {
public:
    LetterMesh(double size, double depth)
        : perUnit_(size / OutlinePoint::kPerEm), back_(static_cast<float>(-depth)), solid_(depth > 0) {}

    void add(const LetterTriangles& shape, const OutlinePoint& at) {
        const std::uint32_t front = count(), many = static_cast<std::uint32_t>(shape.vertices.size());
        for (const OutlinePoint& p : shape.vertices) vertex(place(p, at), 0, {0, 0, 1});
        for (const OutlinePoint& p : shape.vertices) vertex(place(p, at), back_, {0, 0, -1});
        for (const std::uint32_t corner : shape.triangles) indices_.push_back(front + corner);
        for (std::size_t i = 0; i < shape.triangles.size(); i += 3)
            for (const std::size_t k : {0, 2, 1}) indices_.push_back(front + many + shape.triangles[i + k]);
        if (solid_)
            for (const auto& rim : shape.rims) addSides(shape, rim, at);
    }
    [[nodiscard]] DerivedMesh take() const {
        DerivedMesh out;
        if (indices_.empty()) return out;
        out.arrays.positions = Blob::of(std::span<const float>(positions_));
        out.arrays.normals = Blob::of(std::span<const float>(normals_));
        out.arrays.indices = Blob::of(std::span<const std::uint32_t>(indices_));
        return out;
    }

private:
    using Vec2 = std::array<double, 2>;
    [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(positions_.size() / 3); }
    [[nodiscard]] Vec2 place(const OutlinePoint& p, const OutlinePoint& at) const {
        return {perUnit_ * (double(p.x) + at.x), perUnit_ * (double(p.y) + at.y)};
    }
    void vertex(const Vec2& p, float z, const std::array<float, 3>& normal) {
        positions_.insert(positions_.end(), {static_cast<float>(p[0]), static_cast<float>(p[1]), z});
        normals_.insert(normals_.end(), normal.begin(), normal.end());
    }

    /// Right of the rim is outside.
    void addSides(const LetterTriangles& shape, const std::vector<std::uint32_t>& rim, const OutlinePoint& at) {
        const std::size_t many = rim.size();
        const auto point = [&](std::size_t i) { return shape.vertices[rim[i % many]]; };
        const auto outwards = [&](std::size_t i) -> Vec2 {
            const OutlinePoint a = point(i), b = point(i + 1);
            const double x = double(b.y) - a.y, y = double(a.x) - b.x, length = std::hypot(x, y);
            return {x / length, y / length};
        };
        for (std::size_t i = 0; i < many; ++i) {
            const Vec2 own = outwards(i);
            const std::uint32_t first = count();
            const std::pair<std::size_t, Vec2> ends[] = {{i, outwards(i + many - 1)}, {i + 1, outwards(i + 1)}};
            for (const auto& [end, beside] : ends) {
                Vec2 normal = own;
                if (own[0] * beside[0] + own[1] * beside[1] > kSmoothCosine) {
                    const double x = own[0] + beside[0], y = own[1] + beside[1], length = std::hypot(x, y);
                    normal = {x / length, y / length};
                }
                for (const float z : {0.0F, back_})
                    vertex(place(point(end), at), z, {static_cast<float>(normal[0]), static_cast<float>(normal[1]), 0});
            }
            for (const std::uint32_t corner : {0u, 1u, 3u, 0u, 3u, 2u}) indices_.push_back(first + corner);
        }
    }

    double perUnit_;
    float back_;
    bool solid_;
    std::vector<float> positions_, normals_;
    std::vector<std::uint32_t> indices_;
};

DerivedMesh deriveText(const void* core, const Fineness& fineness, const EarlierMesh*) {
    const Text& text = textOf(core);
    const std::shared_ptr<const CutLetters> letters = lettersOf(text.outlines, fineness.steps);
    if (!letters->sound) return {};
    LetterMesh mesh(text.size, text.depth);
    for (const PlacedLetter& letter : letters->outlines.letters) mesh.add(letters->shapes[letter.shape], letter.at);
    return mesh.take();
}

constexpr ScreenSteps kTextScreenSteps{
    .finest =
        [](const void* core) {
            // As fine as there are no more triangles than may be.
            unsigned steps = kTextSteps;
            while (steps > 0 && !lettersOf(textOf(core).outlines, steps)->sound) --steps;
            return steps;
        },
    .screenError = [](const void* core) { return textOf(core).screenError; },
    // Half a unit is what vertices are rounded by, in x and in y.
    .deviation =
        [](const void* core, unsigned steps) {
            return (chordTolerance(steps) + 0.75) * textOf(core).size / OutlinePoint::kPerEm;
        },
    .seam = [](const void*) { return 0.0; },
    .copy = [](const void* core) -> std::shared_ptr<const void> { return std::make_shared<const Text>(textOf(core)); },
};

}  // namespace

constinit const Derivation kTextDerivation{
    .check = &checkText,
    .source = &sourceOfText,
    .derive = &deriveText,
    .resident = [](const void* core) { return isTextHere(textOf(core)); },
    .byScreen = &kTextScreenSteps,
};

}  // namespace tessera
