/// The parts of a body, from the whole down to its faces, as boxes in a frame of the query's choice: what the walks of
/// this folder go down, whatever the body is made of.
#pragma once

#include <array>
#include <cstdint>

#include "common/math/Box.h"
#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

/// Up to sixteen parts, one column each.
struct PartBoxes {
    static constexpr unsigned kMost = 16;
    unsigned count = 0;
    std::array<std::uint32_t, kMost> part;
    std::array<bool, kMost> leaf;
    double lower[3][kMost], upper[3][kMost];

    [[nodiscard]] Box box(unsigned i) const {
        Box out;
        out.lower = {lower[0][i], lower[1][i], lower[2][i]};
        out.upper = {upper[0][i], upper[1][i], upper[2][i]};
        return out;
    }
    void add(std::uint32_t number, bool isLeaf, const Box& box) {
        part[count] = number;
        leaf[count] = isLeaf;
        for (int k = 0; k < 3; ++k) {
            lower[k][count] = box.lower[k];
            upper[k][count] = box.upper[k];
        }
        ++count;
    }
};

struct LeafFaces {
    static constexpr unsigned kMost = 4;
    unsigned count = 0;
    std::array<std::uint32_t, kMost> face;
};

/// Read only; any number of threads. Boxes hold all that they are of as mapped exactly, and what rounding in double can
/// make of it where a query maps it itself.
class BodyParts {
public:
    virtual ~BodyParts() = default;
    /// The whole, as one part. Nothing for a body without faces.
    virtual void whole(PartBoxes& out) const = 0;
    /// What a part that is no leaf is made of.
    virtual void open(std::uint32_t part, PartBoxes& out) const = 0;
    virtual void faces(std::uint32_t leaf, LeafFaces& out) const = 0;
    /// In the body's own frame.
    [[nodiscard]] virtual Triangle triangle(std::uint32_t face) const = 0;
    [[nodiscard]] virtual std::size_t faceCount() const = 0;
};

/// Parts whose boxes can be had one by one, numbered from 0, the whole, with all leaves at the end.
class NumberedParts : public BodyParts {
public:
    explicit NumberedParts(std::uint32_t firstLeaf) : firstLeaf_(firstLeaf) {}
    [[nodiscard]] bool isLeaf(std::uint32_t part) const { return part >= firstLeaf_; }
    [[nodiscard]] virtual Box box(std::uint32_t part) const = 0;

private:
    std::uint32_t firstLeaf_;
};

/// A box of a body's own frame in another one.
class BoxMap {
public:
    /// `reach`: no coordinate of the body is larger, per axis.
    BoxMap(const Affine3d& target_T_body, const Vec3d& reach);

    [[nodiscard]] Box operator()(const Box& box) const;
    /// More than what rounding does to a point's image, per axis.
    [[nodiscard]] const Vec3d& rounding() const { return rounding_; }
    [[nodiscard]] const Affine3d& map() const { return map_; }

private:
    Affine3d map_;
    Mat3d size_;  ///< the map's linear part without signs
    Vec3d rounding_;
    bool same_;  ///< the identity: boxes stay as they are
};

/// No coordinate within a box is larger, per axis.
[[nodiscard]] inline Vec3d reachOf(const Box& box) {
    return box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs());
}

}  // namespace tessera
