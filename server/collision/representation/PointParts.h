/// The parts of a PointSet: the points alone, without their radius.
#pragma once

#include "server/collision/representation/BodyParts.h"
#include "server/collision/representation/PointSet.h"

namespace tessera {

/// Faces are points, as triangles without area.
class PointParts final : public NumberedParts {
public:
    explicit PointParts(const PointSet& points, const Affine3d& target_T_points = Affine3d::Identity())
        : NumberedParts(points.firstLeaf()),
          points_(points),
          map_(target_T_points, points.size() == 0 ? Vec3d(Vec3d::Zero()) : reachOf(points.centres())) {}

    void whole(PartBoxes& out) const override {
        out.count = 0;
        if (points_.size() > 0) out.add(0, false, map_(points_.centres()));
    }
    void open(std::uint32_t part, PartBoxes& out) const override {
        out.count = 0;
        const PointSet::Children of = points_.children(part);
        for (std::uint32_t child = of.first; child < of.end; ++child) out.add(child, isLeaf(child), box(child));
    }
    void faces(std::uint32_t leaf, LeafFaces& out) const override {
        out.count = 0;
        for (const std::uint32_t number : points_.pointsOf(leaf)) out.face[out.count++] = number;
    }
    [[nodiscard]] Box box(std::uint32_t part) const override {
        if (!isLeaf(part)) return map_(points_.box(part));
        Box around;
        for (const std::uint32_t number : points_.pointsOf(part)) around.extend(points_.point(number));
        return map_(around);
    }
    [[nodiscard]] Triangle triangle(std::uint32_t face) const override {
        const Vec3d p = points_.point(face);
        return {p, p, p};
    }
    [[nodiscard]] std::size_t faceCount() const override { return points_.size(); }

private:
    const PointSet& points_;
    BoxMap map_;
};

}  // namespace tessera
