/// What casts shadows in a light's view and rests, in pieces: so that an edit costs what it edits.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "client/render/DrawList.h"

namespace tessera {

/// A thing that stands in a light's way. Of how it looks only that is here which its depths follow from: a material
/// alone that cuts holes into it, or moves its corners.
struct ShadowCaster {
    DrawItem item;
    PixelRect rect;             ///< of the light's map, which has no pixel of it elsewhere
    double front = 0;           ///< nothing of it is nearer to the light, along the light's view; world units
    BlobId positions, indices;  ///< of its mesh
    std::uint64_t mesh = 0;     ///< DrawMesh::serial, where more of its arrays counts; else 0
    std::uint64_t cut = 0;      ///< SceneLook::cut
    std::uint64_t since = 0;    ///< the view's state in which it became what it is
};

/// Where a caster stands: what shares mesh and material stands together, so that it is one call.
struct CasterRank {
    ObjectId material;
    std::uint64_t mesh = 0;  ///< DrawMesh::serial
    bool mirrored = false;
    ObjectId node;
    auto operator<=>(const CasterRank&) const = default;
};
[[nodiscard]] CasterRank rankOf(const ShadowCaster& caster);

/// Casters by rank. No two have the same. Copies share the pieces that no edit has touched since. Reading is for any
/// thread.
class CasterPieces {
public:
    using Piece = std::vector<ShadowCaster>;
    struct Place {
        CasterRank first;  ///< of the piece
        std::shared_ptr<const Piece> piece;
    };
    /// In order; none is empty.
    [[nodiscard]] std::span<const Place> pieces() const { return pieces_; }
    [[nodiscard]] std::size_t size() const { return size_; }
    /// The one that stands there.
    [[nodiscard]] const ShadowCaster& at(const CasterRank& rank) const;
    /// Takes out what stands at `gone`, and puts in `come`. Returns how many casters it has copied for that: a piece
    /// or two for each.
    std::size_t edit(std::vector<CasterRank> gone, std::vector<ShadowCaster> come);

private:
    /// Casters of a piece, at most, and of one that is not joined to its neighbour.
    static constexpr std::size_t kMost = 64, kFew = 16;
    [[nodiscard]] static std::size_t append(std::vector<Place>& to, Piece casters);

    std::vector<Place> pieces_;
    std::size_t size_ = 0;
};

}  // namespace tessera
