/// What casts shadows in a light's view and rests, and where that has changed, in pieces: so that an edit costs what it
/// edits.
#pragma once

#include <cstdint>
#include <memory>
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

/// Casters by rank, no two of which have the same: in pieces, and those in bundles. Copies share whatever no edit has
/// touched since. Reading is for any thread.
class CasterPieces {
public:
    /// A row of elements in order; not empty.
    template <typename Element>
    struct Part {
        CasterRank first;
        PixelRect around;  ///< of the light's map: all that its casters' rectangles touch
        std::shared_ptr<const std::vector<Element>> row;
    };
    using Piece = Part<ShadowCaster>;
    using Bundle = Part<Piece>;
    /// The one that stands there.
    [[nodiscard]] const ShadowCaster& at(const CasterRank& rank) const;
    /// Calls `look` with each caster whose rectangle is `wanted`, in order. Asks for bundles and pieces first: whoever
    /// wants a rectangle wants all that are around it.
    template <typename Wanted, typename Look>
    void each(const Wanted& wanted, const Look& look) const {
        for (const Bundle& bundle : bundles_) {
            if (!wanted(bundle.around)) continue;
            for (const Piece& piece : *bundle.row) {
                if (!wanted(piece.around)) continue;
                for (const ShadowCaster& caster : *piece.row)
                    if (wanted(caster.rect)) look(caster);
            }
        }
    }
    /// Takes out what stands at `gone`, and puts in `come`. Returns how many casters, pieces and bundles it has copied
    /// for that: of each caster a piece or two, a bundle or two, and once all bundles, of which there is one for some
    /// thousand casters.
    std::size_t edit(std::vector<CasterRank> gone, std::vector<ShadowCaster> come);

private:
    std::vector<Bundle> bundles_;
};

/// Where the depths of what rests became others: by the states of a view, the last ones of them. Copies share what has
/// been added long ago.
class StillChanges {
public:
    /// None after that state so far.
    explicit StillChanges(std::uint64_t knownAfter = 0) : knownAfter_(knownAfter) {}
    /// All changes after this state are known.
    [[nodiscard]] std::uint64_t knownAfter() const { return knownAfter_; }
    /// In a state later than all before. Returns how many changes, and rows of them, it has copied.
    std::size_t add(std::uint64_t state, std::vector<PixelRect> rects);
    /// Calls `look` with each rectangle of a later state than this, which is not before `knownAfter`.
    template <typename Look>
    void after(std::uint64_t state, const Look& look) const {
        for (auto row = rows_.rbegin(); row != rows_.rend() && (*row)->back().state > state; ++row)
            for (const Change& change : **row)
                if (change.state > state) look(change.rect);
    }

private:
    struct Change {
        std::uint64_t state = 0;
        PixelRect rect;
    };
    using Row = std::vector<Change>;
    /// Of all, at most; of a row that more are added to.
    static constexpr std::size_t kMost = 1u << 12, kFew = 64;

    std::vector<std::shared_ptr<const Row>> rows_;  ///< ascending; none is empty
    std::size_t size_ = 0;
    std::uint64_t knownAfter_;
};

}  // namespace tessera
