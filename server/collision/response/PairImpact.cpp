#include "server/collision/response/PairImpact.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/FreeformPairs.h"
#include "server/collision/pairwise/WorldFaces.h"
#include "server/collision/response/Chain.h"

namespace tessera {
namespace {

/// A part's surface as the fraction passes.
class Surface {
public:
    Surface(const Part& part, const PartDeformation* deformation) : shape_(*part.shape), deformation_(deformation) {}

    [[nodiscard]] bool deforms() const { return deformation_ != nullptr; }
    [[nodiscard]] const CollisionShape& shape() const { return shape_; }
    [[nodiscard]] const TriangleMesh& mesh() const { return shape_.mesh(); }
    [[nodiscard]] const TriangleTree& tree() const { return shape_.tree(); }
    [[nodiscard]] Vec3d endOf(std::uint32_t vertex) const {
        const bool moves = deformation_ && vertex >= deformation_->first && vertex - deformation_->first < end().size();
        return moves ? end()[vertex - deformation_->first] : shape_.mesh().positions()[vertex];
    }
    [[nodiscard]] Triangle at(std::uint32_t face, double fraction) const {
        Triangle t = shape_.triangle(face);
        if (deformation_)
            for (unsigned i = 0; i < 3; ++i) t[i] += fraction * (endOf(shape_.mesh().vertexOf(face, i)) - t[i]);
        return t;
    }
    [[nodiscard]] std::vector<Vec3d> verticesAt(double fraction) const {
        const MeshPositions start = shape_.mesh().positions();
        std::vector<Vec3d> out(start.begin(), start.end());
        for (std::size_t i = 0; deformation_ && i < end().size(); ++i) {
            Vec3d& p = out[deformation_->first + i];
            p += fraction * (end()[i] - p);
        }
        return out;
    }
    /// They are vertices of the mesh, and all finite.
    [[nodiscard]] bool valid() const {
        return !deformation_ || (deformation_->first + end().size() <= shape_.mesh().vertexCount() &&
                                 std::all_of(end().begin(), end().end(), [](const Vec3d& p) { return p.allFinite(); }));
    }
    /// Of its points in its own frame, on their way. (Vertices without triangles count where they move: never too
    /// small.)
    [[nodiscard]] Reach reach() const {
        Reach reach;
        reach.radius = radiusOf(shape_.bounds(), Affine3d::Identity());
        if (!deformation_) return reach;
        const MeshPositions start = shape_.mesh().positions();
        for (std::size_t i = 0; i < end().size(); ++i) {
            reach.radius = std::max(reach.radius, end()[i].norm());
            reach.speed = std::max(reach.speed, (end()[i] - start[deformation_->first + i]).norm());
        }
        return reach;
    }

private:
    [[nodiscard]] const std::vector<Vec3d>& end() const { return deformation_->end; }

    const CollisionShape& shape_;
    const PartDeformation* deformation_;
};

const PartDeformation* deformationOf(std::span<const PartDeformation> all, std::uint32_t part) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const PartDeformation& d) { return d.part == part; });
    return found == all.end() ? nullptr : &*found;
}

class PairSearch {
public:
    PairSearch(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
               std::span<const PartDeformation> deformations, const WayLookup& wayOf, double tolerance, QueryWork& work)
        : chains_(chainsOf(handler, partA, partB, wayOf)),
          a_(handler.parts()[partA], deformationOf(deformations, partA)),
          b_(handler.parts()[partB], deformationOf(deformations, partB)),
          work_(work),
          // From here on in lengths of the frame below what both share: its own motion parts and joins nothing.
          tolerance_(tolerance / chains_.shared.stretch()) {}

    Impact run() {
        if (!a_.valid() || !b_.valid()) return unknownFrom(0);
        const bool deforms = a_.deforms() || b_.deforms();
        if (!deforms && !chains_.a.moves() && !chains_.b.moves()) return atRest();
        const bool balls = a_.shape().faceRadius() > 0 || b_.shape().faceRadius() > 0;
        if (deforms && !balls && chains_.a.straight() && chains_.b.straight()) return straightVertices();
        return deforms ? advance() : rigid();
    }

    /// See firstSmoothContact.
    Impact runSmooth() {
        if (!chains_.a.moves() && !chains_.b.moves()) return {};
        smooth_ = true;
        return rigid();
    }

    /// See firstContactBeside.
    Impact runBeside(std::span<const Support> supports, std::span<const FacePair> within) {
        if (!chains_.a.moves() && !chains_.b.moves()) return {};
        supports_ = supports;
        within_ = within;
        Impact found = rigid();
        if (found.support >= 0) found.normal = supports[static_cast<std::size_t>(found.support)].normal;
        return found;
    }

private:
    static Impact unknownFrom(double t) {
        Impact out;
        out.t = t;
        out.complete = false;
        return out;
    }

    Impact atRest() {
        const Affine3d worldA = chains_.a.at(0), worldB = chains_.b.at(0);
        const PairTouch found =
            surfaceMethods(a_.shape(), b_.shape()).touch(a_.shape(), b_.shape(), worldA.inverse() * worldB, {work_});
        if (found.touch == Touch::kUnknown) return unknownFrom(0);
        return found.touch == Touch::kYes ? hit(0, found.faces.front()) : Impact{};
    }

    /// In a frame in which each part's way is one motion, which has the tightest bounds; else as they are carried.
    Impact rigid() {
        for (const Mat3d& turnsIn : {Mat3d(Mat3d::Identity()), chains_.a.frameOfTurn(), chains_.b.frameOfTurn()}) {
            const Mat3d frame = turnsIn == Mat3d::Identity() ? turnsIn : Mat3d(turnsIn.inverse());
            if (!frame.allFinite()) continue;
            const std::optional<BodyMotion> a = chains_.a.asOneMotion(frame), b = chains_.b.asOneMotion(frame);
            if (a && b) return along(*a, *b, turnsIn);
        }
        return along(chains_.a.asCarriedMotion(), chains_.b.asCarriedMotion(), Mat3d::Identity());
    }

    /// A fraction after which the two have certainly passed each other; not above 0: they are so from the start. What
    /// grows, turns and goes straight stays within a ball that goes straight.
    double partToLookAt(const BodyMotion& a, const BodyMotion& b) const {
        if (!a.carriers.empty() || !b.carriers.empty()) return 1;
        const auto radius = [](const CollisionShape& shape, const BodyMotion& motion) {
            const double scale =
                std::max(motion.start.scale.cwiseAbs().maxCoeff(), motion.end.scale.cwiseAbs().maxCoeff());
            return radiusOf(shape.bounds(), motion.body_T_mesh) * scale;
        };
        // Twice: with room for the tolerance, for rounding, and for what is smooth beside what is drawn of it.
        const double near = 2 * (radius(a_.shape(), a) + radius(b_.shape(), b)) + 8 * tolerance_;
        const Vec3d from = b.start.translation - a.start.translation,
                    way = b.end.translation - a.end.translation - from;
        const double length = way.stableNorm();
        const double last = near / length - from.dot(way / length) / length;
        return length > 0 && std::isfinite(last) ? std::min(1.0, last) : 1;
    }

    /// The search goes by the coarsest coordinates that it meets, and those far away are coarse: what comes after the
    /// last meeting is cut off.
    Impact along(const BodyMotion& wholeA, const BodyMotion& wholeB, const Mat3d& turnsIn) {
        constexpr double kWorthCutting = 0.25;
        const double part = partToLookAt(wholeA, wholeB);
        if (part <= 0) return {};
        if (part >= kWorthCutting) return lookAt(wholeA, wholeB, 1, turnsIn);
        BodyMotion a = wholeA, b = wholeB;
        a.end = wholeA.at(part);
        b.end = wholeB.at(part);
        return lookAt(a, b, part, turnsIn);
    }

    /// Where the motions are the first `part` of their ways.
    Impact lookAt(const BodyMotion& a, const BodyMotion& b, double part, const Mat3d& turnsIn) {
        const Mat3d world_T_frame = chains_.shared.at(0).linear() * turnsIn;
        const std::vector<Support> supports = seenFrom(world_T_frame);
        const ImpactOptions options{
            .tolerance = tolerance_ / stretchOf(turnsIn), .supports = supports, .within = within_};
        if (smooth_) return smoothAlong(a, b, part, options, world_T_frame);
        return told(ofWhole(
            surfaceMethods(a_.shape(), b_.shape()).firstContact(a_.shape(), a, b_.shape(), b, work_, options), part));
    }

    static Impact ofWhole(Impact found, double part) {
        if (found.hit || !found.complete) found.t *= part;
        return found;
    }

    Impact smoothAlong(const BodyMotion& a, const BodyMotion& b, double part, const ImpactOptions& options,
                       const Mat3d& world_T_frame) {
        Impact found = ofWhole(freeform_pairs::firstContact(a_.shape(), a, b_.shape(), b, work_, options), part);
        if (!found.hit) return found;
        found.point = world_T_frame * found.point + chains_.shared.at(found.t).translation();
        const Vec3d form = world_T_frame.inverse().transpose() * found.normal;
        found.normal = form.allFinite() && !form.isZero(0) ? Vec3d(form.stableNormalized()) : Vec3d::UnitX();
        return found;
    }

    /// A normal is a linear form, and what it says of a length is said in another unit.
    [[nodiscard]] std::vector<Support> seenFrom(const Mat3d& world_T_frame) const {
        std::vector<Support> out(supports_.begin(), supports_.end());
        for (Support& support : out) {
            const Vec3d form = world_T_frame.transpose() * support.normal;
            const double unit = form.norm();
            support.normal = form / unit;
            support.overlap /= unit;
            support.rounding /= unit;
        }
        return out;
    }

    /// Translations alone, so that in the mesh frame of one of them all vertices go straight.
    Impact straightVertices() {
        const bool baseIsA = a_.deforms();
        const Surface &base = baseIsA ? a_ : b_, &other = baseIsA ? b_ : a_;
        const Chain &baseChain = baseIsA ? chains_.a : chains_.b, &otherChain = baseIsA ? chains_.b : chains_.a;
        const Affine3d frame = baseChain.at(0).inverse();
        if (!frame.matrix().allFinite()) return unknownFrom(0);
        const double tolerance = tolerance_ / stretchOf(baseChain.at(0).linear());

        std::vector<Vec3d> baseEnd = base.verticesAt(1);
        const Affine3d base1 = frame * baseChain.at(1);
        if (baseChain.moves())
            for (Vec3d& p : baseEnd) p = base1 * p;
        Box swept = base.mesh().bounds();
        for (const std::uint32_t vertex : base.mesh().indices()) swept.extend(baseEnd[vertex]);
        const double slack = 2 * tolerance + 1e-12 * (swept.lower.cwiseAbs() + swept.upper.cwiseAbs()).maxCoeff();
        swept.lower.array() -= slack;
        swept.upper.array() += slack;

        // Of the other, what comes near: it may be a whole plant.
        const Affine3d other0 = frame * otherChain.at(0), other1 = frame * otherChain.at(1);
        std::vector<std::uint32_t> faces, indices;
        std::vector<double> otherStart;
        std::vector<Vec3d> otherEnd;
        const bool still = !other.deforms() && other0.matrix() == other1.matrix();
        for (const std::uint32_t face : facesThatMayMeet(other, other0, other1, swept)) {
            Triangle from = transformed(other0, other.at(face, 0)), to = from;
            if (!still) to = transformed(other1, other.at(face, 1));
            Box box;
            for (std::size_t i = 0; i < 3; ++i) {
                box.extend(from[i]);
                box.extend(to[i]);
            }
            if (!box.overlaps(swept)) continue;
            faces.push_back(face);
            for (std::size_t i = 0; i < 3; ++i) {
                indices.push_back(static_cast<std::uint32_t>(indices.size()));
                otherStart.insert(otherStart.end(), {from[i].x(), from[i].y(), from[i].z()});
                otherEnd.push_back(to[i]);
            }
        }
        if (faces.empty()) return {};
        Expected<TriangleMesh> mesh = TriangleMesh::make(std::span<const double>(otherStart), indices);
        if (!mesh) return unknownFrom(0);
        // Only its division is looked at, and these boxes are the quickest to fit.
        const TriangleTree near(*std::move(mesh), {.volume = VolumeKind::kAabb});
        const ImpactOptions options{.tolerance = tolerance};
        Impact found = baseIsA ? timeOfImpact(base.tree(), baseEnd, near, otherEnd, work_, options)
                               : timeOfImpact(near, otherEnd, base.tree(), baseEnd, work_, options);
        if (found.hit) (baseIsA ? found.faces.b : found.faces.a) = faces[baseIsA ? found.faces.b : found.faces.a];
        return told(found);
    }

    /// Ascending; all that lie in a box on their way, and others. The maps differ by a shift.
    std::vector<std::uint32_t> facesThatMayMeet(const Surface& other, const Affine3d& other0, const Affine3d& other1,
                                                const Box& swept) {
        const Affine3d back = other0.inverse();
        std::vector<std::uint32_t> faces;
        if (!other.deforms() && back.matrix().allFinite()) {
            // Whoever is shifted into the box comes from the box shifted back.
            const Vec3d shift = other1.translation() - other0.translation();
            Box from = swept;
            from.lower -= shift.cwiseMax(0);
            from.upper -= shift.cwiseMin(0);
            const Box& bounds = other.shape().bounds();
            const double extent = std::max(radiusOf(bounds, other0), radiusOf(bounds, other1));
            from.lower.array() -= 1e-12 * extent;
            from.upper.array() += 1e-12 * extent;
            if (facesNear(other.shape(), boxAround(back, from), work_, faces)) return faces;
        }
        faces.resize(other.shape().faceCount());
        std::iota(faces.begin(), faces.end(), 0U);
        return faces;
    }

    /// The gap over a bound of all speeds is free of contact; so is what is left then, and so on.
    Impact advance() {
        const Reach reachA = chains_.a.reach(a_.reach()), reachB = chains_.b.reach(b_.reach());
        const double speed = (reachA.speed + reachB.speed) * (1 + 1e-12);
        const double rounding = 0x1p-53 * 64 * (reachA.radius + reachB.radius);
        const double tolerance = tolerance_ > 4 * rounding ? tolerance_ : 4 * rounding;
        const std::shared_ptr<CollisionShape> ownA = ownOf(a_), ownB = ownOf(b_);
        double t = 0;
        DistanceOptions options;
        for (int step = 0; step < kMostAdvances && !work_.exhausted(); ++step) {
            if (!moveTo(t, a_, ownA) || !moveTo(t, b_, ownB)) return unknownFrom(t);
            const Affine3d worldA = chains_.a.at(t), worldB = chains_.b.at(t), a_T_shared = worldA.inverse();
            if (!a_T_shared.matrix().allFinite()) return unknownFrom(t);
            const CollisionShape &nowA = ownA ? *ownA : a_.shape(), &nowB = ownB ? *ownB : b_.shape();
            const Distance d = surfaceMethods(nowA, nowB).distance(nowA, nowB, a_T_shared * worldB, work_, options);
            if (!d.complete) return unknownFrom(t);
            if (d.farther) return {};  // nothing there
            options.start = d.faces;
            if (d.distance == 0 || (worldA.linear() * (d.onB - d.onA)).norm() <= tolerance) return hit(t, d.faces);
            const double gap = d.distance / stretchOf(a_T_shared.linear()) * (1 - 1e-12) - rounding;
            if (!(gap > 0)) return hit(t, d.faces);
            if (!(speed > 0) || t + gap / speed > 1) return {};
            t += gap / speed;
        }
        return unknownFrom(t);
    }
    static std::shared_ptr<CollisionShape> ownOf(const Surface& surface) {
        if (!surface.deforms()) return nullptr;
        return CollisionShape::ofTriangles(surface.mesh(), {.volume = surface.shape().volume()});
    }
    static bool moveTo(double t, const Surface& surface, const std::shared_ptr<CollisionShape>& own) {
        return !own || own->move(surface.verticesAt(t)).has_value();
    }

    /// What a query said in another frame, with its place and direction in the world.
    Impact told(const Impact& found) {
        if (!found.hit) return found;
        Impact out = hit(found.t, found.faces);
        out.complete = found.complete;
        out.support = found.support;
        return out;
    }

    Impact hit(double t, FacePair faces) {
        Impact out;
        out.hit = true;
        out.t = t;
        out.faces = faces;
        const Affine3d worldA = chains_.shared.at(t) * chains_.a.at(t), worldB = chains_.shared.at(t) * chains_.b.at(t);
        const WorldFaces placed{placedFace(worldA, a_.at(faces.a, t)), placedFace(worldB, b_.at(faces.b, t)),
                                faceRadiusIn(a_.shape(), worldA), faceRadiusIn(b_.shape(), worldB)};
        const WorldFaces::Meeting meeting = placed.meeting();
        out.distance = placed.nearest().distance;
        out.point = meeting.point;
        out.normal = meeting.normal;
        return out;
    }

    ChainPair chains_;
    Surface a_, b_;
    QueryWork& work_;
    bool smooth_ = false;  ///< asked as the smooth surfaces that they are
    double tolerance_;
    std::span<const Support> supports_;
    std::span<const FacePair> within_;
};

Impact search(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
              std::span<const PartDeformation> deformations, const WayLookup& wayOf, double tolerance,
              QueryWork& work) {
    if (!handler.parts()[partA].solid() || !handler.parts()[partB].solid()) return {};
    return PairSearch(handler, partA, partB, deformations, wayOf, tolerance, work).run();
}

}  // namespace

Impact firstContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB, const WayLookup& wayOf,
                    double tolerance, QueryWork& work) {
    return search(handler, partA, partB, handler.deformations(), wayOf, tolerance, work);
}

Impact firstRigidContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB, const WayLookup& wayOf,
                         double tolerance, QueryWork& work) {
    return search(handler, partA, partB, {}, wayOf, tolerance, work);
}

Impact firstSmoothContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                          const WayLookup& wayOf, double tolerance, QueryWork& work) {
    if (!handler.parts()[partA].solid() || !handler.parts()[partB].solid()) return {};
    return PairSearch(handler, partA, partB, {}, wayOf, tolerance, work).runSmooth();
}

Impact firstContactBeside(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                          const WayLookup& wayOf, double tolerance, std::span<const Support> supports,
                          std::span<const FacePair> within, QueryWork& work) {
    if (!handler.parts()[partA].solid() || !handler.parts()[partB].solid()) return {};
    return PairSearch(handler, partA, partB, {}, wayOf, tolerance, work).runBeside(supports, within);
}

}  // namespace tessera
