/// A scene whose transforms are led by a response, one after the other, as the frame loop would; and brute force beside
/// it.
#pragma once

#include <algorithm>
#include <random>

#include "common/scene/Action.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/response/PairImpact.h"
#include "server/collision/response/Response.h"
#include "tests/unit/motion/Bodies.h"
#include "tests/unit/objects/ObjectScene.h"

namespace tessera {

inline Soup soupOf(const bodies::Body& body) {
    Soup soup;
    for (const double x : body.positions) soup.positions.push_back(static_cast<float>(x));
    soup.indices = body.indices;
    return soup;
}

class TrialScene : public ObjectScene {
public:
    double stopTolerance = 1e-4;
    std::uint64_t maxTests = ~std::uint64_t{0};
    bool slides = false;  ///< all pairs let slide, and so the response does
    /// Of the last motion.
    std::uint64_t queries = 0;
    QueryWork work;

    Thing body(ObjectId parent, const bodies::Body& shape, const Vec3d& where,
               const Quatd& rotation = Quatd::Identity(), const Vec3d& scale = Vec3d::Ones()) {
        Thing out = thing(parent, Vec3d::Zero(), soupOf(shape));
        move(out.transform, where, rotation, scale);
        return out;
    }
    void watch(ObjectId object, ObjectId against = {}) {
        Interest value;
        value.object = object;
        value.against = against;
        value.response = slides ? Interest::kSlide : Interest::kStop;
        interest(value);
    }
    [[nodiscard]] Pose at(ObjectId transform) const {
        const Transform& t = *aspect.get<Transform>(transform);
        return {t.translation, t.rotation, t.scale};
    }
    [[nodiscard]] Vec3d placeOf(ObjectId transform) const { return at(transform).translation; }
    void put(ObjectId transform, const Pose& pose) { move(transform, pose.translation, pose.rotation, pose.scale); }

    /// All pairs of parts that may not be led into each other by this transform.
    [[nodiscard]] std::vector<ObstaclePair> pairsOf(ObjectId transform, const Way& way) const {
        std::vector<ObstaclePair> pairs;
        const auto wayOf = [&](ObjectId id) { return id == transform ? &way : nullptr; };
        std::vector<std::uint32_t> parts;  // in document order
        for (std::uint32_t part = 0; part < handler.parts().size(); ++part)
            if (handler.parts()[part].node) parts.push_back(part);
        std::ranges::sort(parts, [&](std::uint32_t a, std::uint32_t b) { return handler.before(a, b); });
        std::vector<Box> boxes;
        std::vector<std::uint32_t> carriers;
        for (const std::uint32_t part : parts) {
            boxes.push_back(boxOnAllWays(handler, part, wayOf, slides));
            carriers.push_back(PartOnTheWay(handler, part, transform).carrier());
        }
        for (std::size_t i = 0; i < parts.size(); ++i)
            for (std::size_t k = i + 1; k < parts.size(); ++k) {
                const std::uint32_t a = parts[i], b = parts[k];
                const Relation relation = handler.relation(a, b);
                if (!relation.relevant || relation.response == Interest::kReport || carriers[i] == carriers[k])
                    continue;
                if (!boxes[i].overlaps(boxes[k])) continue;
                pairs.push_back(relation.firstIsObject ? ObstaclePair{a, b, relation.response == Interest::kSlide}
                                                       : ObstaclePair{b, a, relation.response == Interest::kSlide});
            }
        return pairs;
    }
    /// Leads a transform towards a pose and commits where it came.
    Resolution go(ObjectId transform, const Pose& wanted) {
        const Way way{at(transform), wanted};
        queries = 0;
        work = {.limit = maxTests};
        const auto touchingAtStart = [&](std::uint32_t a, std::uint32_t b) -> std::uint64_t {
            QueryWork free;
            const auto parts = handler.parts();
            return allTouching(parts[a].shape->tree(), parts[b].shape->tree(),
                               parts[a].world.inverse() * parts[b].world, free)
                .pairs.size();
        };
        const MotionTrial trial(handler, transform, way, pairsOf(transform, way), touchingAtStart, stopTolerance, work,
                                queries);
        Resolution resolution = (slides ? makeSlideResponse() : makeStopResponse())->resolve(trial);
        obstacles.assign(trial.obstacles().begin(), trial.obstacles().end());
        put(transform, resolution.accepted);
        return resolution;
    }
    Resolution goTo(ObjectId transform, const Vec3d& translation) {
        Pose wanted = at(transform);
        wanted.translation = translation;
        return go(transform, wanted);
    }
    std::vector<Obstacle> obstacles;  ///< of the last motion

    [[nodiscard]] TriangleMesh meshOf(ObjectId shapeNode) const {
        const Geometry& g = *aspect.coreOf<Geometry>(*aspect.get<Node>(shapeNode));
        return *TriangleMesh::make(g.positions.as<float>(), g.indices.as<std::uint32_t>());
    }
    /// By the predicate on every pair of faces, straight from the committed scene, in A's frame.
    [[nodiscard]] bool touching(ObjectId shapeA, ObjectId shapeB) const {
        const Affine3d a_T_b = worldTransform(aspect, shapeA).inverse() * worldTransform(aspect, shapeB);
        return bodies::touching(bodies::facesOf(meshOf(shapeA), Affine3d::Identity()),
                                bodies::facesOf(meshOf(shapeB), a_T_b));
    }
    /// In the world, by brute force.
    [[nodiscard]] double distance(ObjectId shapeA, ObjectId shapeB) const {
        return bodies::distance(bodies::facesOf(meshOf(shapeA), worldTransform(aspect, shapeA)),
                                bodies::facesOf(meshOf(shapeB), worldTransform(aspect, shapeB)));
    }
};

/// Seeded numbers.
class Dice {
public:
    explicit Dice(unsigned seed) : random_(seed) {}
    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    Vec3d vector(double low, double high) { return {uniform(low, high), uniform(low, high), uniform(low, high)}; }
    Vec3d direction() {
        const Vec3d v(normal_(random_), normal_(random_), normal_(random_));
        return v.normalized();
    }
    Quatd rotation() {
        return Quatd(normal_(random_), normal_(random_), normal_(random_), normal_(random_)).normalized();
    }
    Quatd rotation(double most) { return Quatd(Eigen::AngleAxisd(uniform(-most, most), direction())); }
    bool chance(double p) { return uniform(0, 1) < p; }
    std::mt19937& engine() { return random_; }

private:
    std::mt19937 random_;
    std::normal_distribution<double> normal_;
};

}  // namespace tessera
