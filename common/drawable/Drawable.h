/// Which cores can be drawn, picked and collided with, and what each has for that: one registry, asked by renderer,
/// collision, picking, view, committer and report, none of which names such a type.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/drawable/Derivation.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Names a mesh by its content: drawables with equal keys look alike, but for their material.
struct MeshKey {
    std::array<BlobId, kMeshArrays> arrays{};  ///< in the order of MeshArrays
    MeshKind kind = MeshKind::kTriangles;
    bool sorted = false;
    double pointRadius = 0;
    bool operator==(const MeshKey&) const = default;
};
[[nodiscard]] MeshKey keyOf(const MeshArrays& arrays);
struct MeshKeyHash {
    std::size_t operator()(const MeshKey& key) const {
        std::size_t h = std::hash<double>{}(key.pointRadius) + 2 * static_cast<std::size_t>(key.kind) + key.sorted;
        for (const BlobId& id : key.arrays) h = h * 0x9E3779B97F4A7C15ull + std::hash<BlobId>{}(id);
        return h;
    }
};

/// An earlier mesh that edits of ranges have led from to a present one: who keeps something of it changes a part.
struct MeshOrigin {
    MeshKey key;
    MeshRanges changed;
};
/// The nearest first, as far as its arrays remember (see Blob::origins); empty where none came from ranges.
[[nodiscard]] std::vector<MeshOrigin> originsOf(const MeshArrays& arrays);

/// What a type of drawable says of itself; the functions take one of its objects. A new drawable is one entry in
/// Drawable.cpp.
struct DrawableType {
    ObjectType type;
    /// Its surface (triangles or points) or its lines: handles on arrays, not yet checked (checkMesh). What a picture,
    /// a pick and a collision share. `trianglesOfPoints` makes triangles of points for whoever knows nothing else.
    /// Null: they are derived.
    MeshArrays (*arrays)(const void*) = nullptr;
    /// A Material, or none.
    ObjectId (*material)(const void*) = nullptr;
    /// How its arrays are made of its fields (Derivation.h). Null: they are its fields.
    const Derivation* derivation = nullptr;
};

/// One drawable core where it lies: holds until the aspect's next apply.
class Drawable {
public:
    Drawable() = default;
    Drawable(const DrawableType& type, const void* core) : type_(&type), core_(core) {}

    [[nodiscard]] explicit operator bool() const { return core_ != nullptr; }
    /// Derived arrays are sound, or empty where what they are made of is not here.
    [[nodiscard]] MeshArrays arrays() const {
        return type_->derivation ? derivedArrays(*type_->derivation, core_, fineness_) : type_->arrays(core_);
    }
    [[nodiscard]] bool derived() const { return type_->derivation != nullptr; }
    /// What derived arrays are made of; nothing of others, and where there is nothing to be seen.
    [[nodiscard]] std::optional<DerivedSource> source() const {
        return derived() ? type_->derivation->source(core_, fineness_) : std::nullopt;
    }
    /// Of derived triangles: the smooth surface that they are of. Null where there is none. Made anew by each call.
    [[nodiscard]] std::shared_ptr<const SmoothSurface> smoothSurface() const {
        return derived() && type_->derivation->smooth ? type_->derivation->smooth(core_) : nullptr;
    }
    [[nodiscard]] ObjectId material() const { return type_->material(core_); }
    [[nodiscard]] MeshKey key() const { return keyOf(arrays()); }
    /// Whether all its bytes are here.
    [[nodiscard]] bool resident() const;
    /// In its own coordinates; empty where its corners are not here. Of what says so itself (Derivation::bounds) around
    /// all that it can be.
    [[nodiscard]] Box bounds() const {
        return hasOwnBounds() ? type_->derivation->bounds(core_) : shownBounds(arrays());
    }
    [[nodiscard]] bool hasOwnBounds() const { return type_->derivation && type_->derivation->bounds; }
    /// Nobody collides with it, whatever its arrays are.
    [[nodiscard]] bool meetsNobody() const { return type_->derivation && type_->derivation->meetsNobody; }
    /// As it is shown and as its arrays say, wherever their bytes are. 0 of what would be derived from absent ones.
    [[nodiscard]] std::uint64_t triangleCount() const {
        return derived() && type_->derivation->triangles ? type_->derivation->triangles(core_)
                                                         : tessera::triangleCount(arrays());
    }
    /// Whether its arrays fit together; nothing at all is fine. Where they came by edits of ranges from `sound`, a mesh
    /// that was found sound before, this costs what the ranges hold; where its points have another radius, nothing. Of
    /// a derived drawable: whether its fields fit together, and nothing is derived.
    [[nodiscard]] Expected<void> check(const MeshKey& sound = {}) const;

    /// The same, with arrays that are so much finer than its fields say; nobody but a screen asks for that.
    [[nodiscard]] Drawable at(Fineness fineness) const {
        Drawable finer = *this;
        finer.fineness_ = std::move(fineness);
        return finer;
    }
    /// Null where it has one fineness alone, or its fields want no other.
    [[nodiscard]] const ScreenSteps* byScreen() const {
        const ScreenSteps* steps = type_->derivation ? type_->derivation->byScreen : nullptr;
        return steps && steps->screenError(core_) > 0 ? steps : nullptr;
    }
    /// The same drawable with a core of its own, which `keeper` then owns. Only of what is drawn by screen.
    [[nodiscard]] Drawable kept(std::shared_ptr<const void>& keeper) const {
        keeper = byScreen()->copy(core_);
        return Drawable(*type_, keeper.get());
    }
    /// See ScreenSteps. Only of what is drawn by screen.
    [[nodiscard]] unsigned finest() const { return byScreen()->finest(core_); }
    [[nodiscard]] double screenError() const { return byScreen()->screenError(core_); }
    [[nodiscard]] double deviation() const { return byScreen()->deviation(core_, fineness_.steps); }
    [[nodiscard]] double seam() const { return byScreen()->seam(core_); }
    /// Null where it steps as a whole.
    [[nodiscard]] std::shared_ptr<const ScreenParts> parts() const {
        return byScreen()->parts ? byScreen()->parts(core_) : nullptr;
    }

private:
    const DrawableType* type_ = nullptr;
    const void* core_ = nullptr;
    Fineness fineness_;
};

/// Null: nothing of this type is drawn.
[[nodiscard]] const DrawableType* findDrawable(ObjectType type);
[[nodiscard]] inline bool isDrawable(ObjectType type) {
    return findDrawable(type) != nullptr;
}
/// False for an object that is not there or is nothing to be drawn.
[[nodiscard]] Drawable drawableOf(const Object& core);
[[nodiscard]] inline Drawable drawableOf(const Aspect& aspect, ObjectId core) {
    return core ? drawableOf(aspect.find(core)) : Drawable();
}
/// Of a node's core.
[[nodiscard]] inline Drawable drawableOf(const Aspect& aspect, const Node& node) {
    return drawableOf(aspect, node.core);
}

}  // namespace tessera
