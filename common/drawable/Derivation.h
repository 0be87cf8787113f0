/// Drawables whose arrays are not their fields but are made of them: surfaces that control points stand for.
///
/// A type says what its arrays depend on and how they are made; renderer, collision and picks ask `Drawable` as they
/// ask one of arrays. What is made is made once a process, by content, and kept while somebody keeps its positions.
/// Edits of ranges of the control points lead from arrays to arrays by `Blob::withRange`: so these have origins
/// (Drawable.h, originsOf), and who follows ranges follows them.
///
/// How fine they are is a Fineness: 0 is as the fields say, for whoever collides, picks and counts; a screen may draw
/// finer ones, everywhere or in parts (client/render/scene/ScreenFineness.h).
///
/// Every host derives for itself, and seams and collisions rest on all getting the same bytes: a derivation is a pure
/// function of its source, with no clock, no order of asking, no eye, and the same result along every way of edits.
/// (One build of the programs on all hosts: processors agree on IEEE's operations, compilers need not agree on their
/// order.) Nothing of it is in a scene's state or hash.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/drawable/Fineness.h"
#include "common/geometry/Mesh.h"

namespace tessera {

struct DerivedMesh {
    MeshArrays arrays;
    /// What the type wants to find again when the points have moved: rows of weights, …; any thread reads it.
    std::shared_ptr<const void> plan;

    [[nodiscard]] std::size_t bytes() const {
        return 512 + arrays.positions.sizeBytes() + arrays.normals.sizeBytes() + arrays.copies.sizeBytes();
    }
    /// Indices may be shared by all positions of the points, and a mesh by many copies of it; these are not.
    [[nodiscard]] bool inUse() const {
        const Blob& own = arrays.copies.empty() ? arrays.positions : arrays.copies;
        return !own.empty() && !own.soleHandle();
    }
};

struct DerivedSource {
    Hash128 recipe;  ///< of all that the arrays depend on but where the control points are; other types' differ
    Blob points;     ///< the control points: what ranges are edited of
};

/// An earlier state, of the same recipe and as many points, and the bytes of the points that have changed since.
struct EarlierMesh {
    const DerivedMesh& mesh;
    ByteRange changed;
};

struct ScreenSteps;
struct SmoothSurface;  // SmoothSurface.h

/// The functions take one of the type's objects.
struct Derivation {
    /// What is wrong with it: asked before an edit is applied. Nothing at all is fine. Absent arrays are not.
    Expected<void> (*check)(const void*);
    /// Nothing where there is nothing to be seen, or an array is not here. The recipe tells finenesses apart.
    std::optional<DerivedSource> (*source)(const void*, const Fineness& fineness);
    /// Empty arrays where the object is none that `check` lets pass, or where it would take too many triangles. With or
    /// without `earlier`, which is as fine, the same bytes.
    DerivedMesh (*derive)(const void*, const Fineness& fineness, const EarlierMesh* earlier);
    /// Whether all the bytes that it is made of are here.
    bool (*resident)(const void*);
    /// Null: it has one fineness alone.
    const ScreenSteps* byScreen = nullptr;
    /// The smooth surface that the triangles are of. Null: there is none, or the object is none that `check` lets pass.
    std::shared_ptr<const SmoothSurface> (*smooth)(const void*) = nullptr;
    /// A box around whatever is ever there, in the object's own coordinates, without the arrays; what is drawn around
    /// places included. Null: it is as its arrays are.
    Box (*bounds)(const void*) = nullptr;
    /// How many triangles are shown, without the arrays; 0 of what `check` does not let pass. Null: as many as there
    /// are.
    std::uint64_t (*triangles)(const void*) = nullptr;
    /// Nobody collides with it: whoever asks for that takes no arrays.
    bool meetsNobody = false;
};

/// What a screen may draw finer by itself: of a subdivision surface its control faces.
struct ScreenParts {
    /// Steps that anything can be finer by, and one.
    static constexpr std::size_t kSteps = 7;
    struct Part {
        std::array<float, 3> lower{}, upper{};  ///< around whatever the part can be, in the object's own coordinates
        std::array<float, kSteps> deviation{};  ///< by steps: see ScreenSteps
        std::uint32_t triangles = 0;  ///< as the fields say; each step makes four of one. 0: the part has no surface
        std::uint32_t rim =
            0;  ///< segments around it, as the fields say: so many triangles more its neighbours have for a step of it
        [[nodiscard]] Box box() const {
            return {Vec3f(lower[0], lower[1], lower[2]).cast<double>(),
                    Vec3f(upper[0], upper[1], upper[2]).cast<double>()};
        }
    };
    /// Parts that follow each other, kGroup of them: for who looks at many.
    static constexpr std::size_t kGroup = 16;
    struct Group {
        Box box;              ///< around those that have a surface
        float deviation = 0;  ///< of any, as the fields say
    };
    std::vector<Part> parts;
    std::vector<Group> groups;
    unsigned finest = 0;

    [[nodiscard]] std::size_t bytes() const { return 256 + parts.size() * sizeof(Part); }
};

/// What a screen asks of a derivation that it may draw finer. The functions take one of the type's objects.
struct ScreenSteps {
    unsigned (*finest)(const void*);
    double (*screenError)(const void*);  ///< pixels; 0: only as the fields say
    /// How far surface and triangles of so many steps everywhere are from each other, in the object's own coordinates,
    /// without rounding to floats: of NURBS at most, of subdivision surfaces an estimate on the safe side. A pure
    /// function of the object.
    double (*deviation)(const void*, unsigned steps);
    /// Objects with the same number above 0 that are as fine have the same vertices on edges that they share. 0: it
    /// shares none.
    double (*seam)(const void*);
    std::shared_ptr<const void> (*copy)(const void*);
    /// What may be as fine as it likes by itself, a pure function of the object; made once a process, in time
    /// proportional to what has moved. Null function: it steps as a whole. Null: there is nothing to be seen.
    std::shared_ptr<const ScreenParts> (*parts)(const void*) = nullptr;
};

/// Of what nobody keeps, so much is kept for who asks next.
inline constexpr std::size_t kMostUnusedDerivedBytes = std::size_t{1} << 28;

/// Made, or found. Any thread; waits for another thread that is making the same.
[[nodiscard]] MeshArrays derivedArrays(const Derivation& derivation, const void* core, const Fineness& fineness = {});

}  // namespace tessera
