#include "server/sim/navigation/Walker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/collision/query/CapsuleSweep.h"

namespace tessera {
namespace {

constexpr double kGravity = 9.81;      // m/s²
constexpr double kFastestFall = 50;    // m/s
constexpr double kRise = 3;            // m/s: how fast the feet follow steps and slopes
constexpr double kPush = 2;            // m/s: how fast a body gets out of what it is in
constexpr double kLevelGround = 1e-4;  // m: ground that is nearer to the feet is where they are
constexpr double kOverlap = 1e-4;      // m: less is contact
constexpr double kNoGround = std::numeric_limits<double>::infinity();
constexpr double kSkin =
    1e-3;  // m: up and down nobody comes nearer, so that edges overhead do not catch who goes on the level
constexpr double kCoreRadius = 0.05;  // m: around its axis a body is free where it stands up
constexpr double kShortest = 0.1;     // m: of a body below a low ceiling
constexpr int kSlides = 4;            // faces along which one frame may slide
constexpr double kCoarsest = 1e-5;    // m: between neighbouring numbers where one stands; beyond nobody walks

const Vec3d kUp = Vec3d::UnitY();

Vec3d onLevel(const Vec3d& v) {
    return {v.x(), 0, v.z()};
}

}  // namespace

/// One frame in metres around the eyes as they were at its begin, where all numbers are small.
class Walker::Frame {
public:
    Frame(const Navigation& terms, double height, std::vector<Triangle> obstacles)
        : terms_(terms), obstacles_(std::move(obstacles)), height_(height) {}

    [[nodiscard]] const Vec3d& eye() const { return eye_; }
    [[nodiscard]] double height() const { return height_; }
    [[nodiscard]] double feet() const { return eye_.y() - height_; }

    /// Out of what it is in, no farther than `most`.
    void pushOut(double most) {
        const Capsule body = capsule();
        double deepest = kOverlap;
        Vec3d way = Vec3d::Zero();
        for (const Triangle& obstacle : obstacles_) {
            const SegmentGap gap = gapBetween(body.a, body.b, obstacle);
            const double depth = body.radius - gap.distance;
            if (gap.distance == 0 || depth <= deepest) continue;
            deepest = depth;
            way = std::min(depth, most) * gap.normal;
        }
        if (deepest > kOverlap) advance(way);
    }

    /// As far as `way` leads, along what is in the way. `level`: what is in the way counts as upright, so that nobody
    /// is led up or down.
    void slide(Vec3d way, bool level) {
        std::vector<Vec3d> walls;
        const double whole = way.norm();
        for (int i = 0; i < kSlides && way.norm() > 1e-9 * whole; ++i) {
            const std::optional<CapsuleHit> hit = sweepCapsule(capsule(level ? 0 : kSkin), way, obstacles_);
            if (!hit) {
                eye_ += way;
                return;
            }
            eye_ += hit->t * way;
            Vec3d wall = level ? onLevel(hit->normal) : hit->normal;
            if (!(wall.norm() > 1e-9)) return;
            wall.normalize();
            way = (1 - hit->t) * way;
            way -= way.dot(wall) * wall;
            // Where two walls meet: along the edge between them, and upright walls leave none.
            for (const Vec3d& before : walls) {
                if (way.dot(before) >= -1e-12 * whole) continue;
                const Vec3d edge = before.cross(wall);
                if (level || !(edge.norm() > 1e-6)) return;
                way = way.dot(edge) / edge.squaredNorm() * edge;
            }
            walls.push_back(wall);
        }
    }

    struct Ground {
        double height = 0;  ///< where the feet would be
        bool steep = false;
    };
    /// Below the feet, no deeper than `down`, or above them as high as a step. A ball half as wide as the body finds
    /// it, so that nobody falls into a crack; where that lies on an edge the point below the middle says what there is.
    [[nodiscard]] std::optional<Ground> ground(double down) const {
        const double steep = std::cos(terms_.steepestDegrees * std::numbers::pi / 180);
        const Vec3d from = capsule().a;
        const double above = from.y() - feet();
        std::optional<Ground> found;
        for (const double radius : {std::min(terms_.bodyRadius, above) / 2, 0.001}) {
            const Vec3d way = -(above + down - radius) * kUp;
            const std::optional<CapsuleHit> hit = sweepCapsule({from, from, radius}, way, obstacles_);
            if (!hit) continue;
            found = Ground{.height = from.y() + hit->t * way.y() - radius, .steep = hit->normal.y() < steep};
            if (!found->steep) break;
        }
        return found;
    }

    /// As a whole, up or down.
    void lift(double height) {
        const Vec3d way = height * kUp;
        const std::optional<CapsuleHit> hit = sweepCapsule(capsule(kSkin), way, obstacles_);
        eye_.y() += (hit ? hit->t : 1) * height;
    }
    /// The head alone goes up, or down where `by` is below 0: within the body first, where nothing can be.
    void grow(double by) {
        const double within = by < 0 ? std::max(by, capsule().a.y() - eye_.y()) : 0;
        eye_.y() += within;
        const std::optional<CapsuleHit> hit =
            sweepCapsule({eye_, eye_, terms_.bodyRadius + kSkin}, (by - within) * kUp, obstacles_);
        const double done = (hit ? hit->t : 1) * (by - within);
        eye_.y() += done;
        height_ += within + done;
    }
    void goBackTo(const Vec3d& place) { eye_ = place; }

private:
    [[nodiscard]] Capsule capsule(double skin = 0) const {
        const double low = std::min(eye_.y(), feet() + terms_.step + terms_.bodyRadius);
        return {{eye_.x(), low, eye_.z()}, eye_, terms_.bodyRadius + skin};
    }
    void advance(const Vec3d& way) {
        const std::optional<CapsuleHit> hit = sweepCapsule(capsule(), way, obstacles_);
        eye_ += (hit ? hit->t : 1) * way;
    }

    const Navigation& terms_;
    std::vector<Triangle> obstacles_;
    Vec3d eye_ = Vec3d::Zero();
    double height_;
};

bool Walker::standAt(const Vec3d& eye, double height, double scale, const Surroundings& around) {
    eye_ = eye;
    scale_ = scale;
    height_ = std::max(height, kShortest);
    fall_ = 0;
    onGround_ = false;
    // Who comes from above lands on his feet; who was set down lower than he is tall rises from there.
    const std::optional<double> below = around.hit({.origin = eye, .direction = -scale * kUp});
    if (!below) return false;
    if (*below < height_) height_ = std::max(*below, kShortest);
    // What the body would stand in below the head, a wall that leans, makes it shorter: from the eyes down it is free.
    const double reach = height_ - terms_.step - terms_.bodyRadius;
    if (!(reach > 0)) return true;
    Box world;
    world.extend(Vec3d(eye + Vec3d::Constant(scale * 0.1)));
    world.extend(Vec3d(eye - Vec3d::Constant(scale * 0.1) - scale * reach * kUp));
    std::vector<Triangle> obstacles;
    if (!around.facesIn(world, obstacles)) return false;
    for (Triangle& t : obstacles)
        for (Vec3d& corner : t) corner = (corner - eye) / scale;
    if (const auto hit = sweepCapsule({Vec3d::Zero(), Vec3d::Zero(), kCoreRadius}, -reach * kUp, obstacles))
        height_ -= (1 - hit->t) * reach;
    return true;
}

Vec3d Walker::step(const Vec3d& wish, double height, double seconds, const Surroundings& around) {
    if (!(2.3e-16 * eye_.cwiseAbs().maxCoeff() <= kCoarsest * scale_)) return eye_;
    height = std::max(height, kShortest);
    Vec3d way = onLevel(wish);
    const double farthest = kFastestWalk * seconds;
    if (way.norm() > farthest) way *= farthest / way.norm();
    const double drop = std::min(kFastestFall, fall_ + kGravity * seconds) * seconds;

    // All that anything in this frame may touch, in the body's metres.
    const double push = kPush * seconds, rise = kRise * seconds;
    // Who slides goes anywhere, though no farther than he meant to.
    const Vec3d reach =
        Vec3d::Constant(terms_.bodyRadius + push + drop + 2 * rise + 0.01) + way.norm() * Vec3d(1, 0, 1);
    Box box;
    box.lower = -reach - (height_ + terms_.step) * kUp;
    box.upper = reach;
    Box world;
    world.lower = eye_ + scale_ * box.lower;
    world.upper = eye_ + scale_ * box.upper;
    std::vector<Triangle> obstacles;
    if (!around.facesIn(world, obstacles)) return eye_;  // who cannot see what is there stays
    for (Triangle& t : obstacles)
        for (Vec3d& corner : t) corner = (corner - eye_) / scale_;

    Frame frame(terms_, height_, std::move(obstacles));
    frame.pushOut(push);
    if (frame.height() > height) frame.grow(height - frame.height());

    const Vec3d before = frame.eye();
    frame.slide(way, true);
    std::optional<Frame::Ground> ground = frame.ground(std::max(terms_.step, drop));
    // Up a slope that is too steep nobody goes.
    if (ground && ground->steep && ground->height > frame.feet() + kLevelGround && frame.eye() != before) {
        frame.goBackTo(before);
        ground = frame.ground(std::max(terms_.step, drop));
    }

    const double gap = ground ? frame.feet() - ground->height : 0;
    if (ground && std::abs(gap) <= kLevelGround) {
        fall_ = 0;
        onGround_ = true;
    } else if (ground && gap < 0) {
        frame.lift(std::min(-gap, rise));
        fall_ = 0;
        onGround_ = true;
    } else if (ground && onGround_ && gap <= terms_.step) {
        frame.lift(-std::min(gap, rise));
        fall_ = 0;
    } else if (ground || std::isfinite(around.hit({.origin = eye_, .direction = -scale_ * kUp}).value_or(kNoGround))) {
        onGround_ = false;
        fall_ = std::min(kFastestFall, fall_ + kGravity * seconds);
        const double fallen = ground ? std::min(gap, drop) : drop, from = frame.eye().y();
        frame.slide(-fallen * kUp, false);
        // Something holds the body where the feet find nothing.
        if (from - frame.eye().y() < 0.01 * fallen) {
            fall_ = 0;
            onGround_ = true;
        }
    } else {
        // Below there is nothing at all, or nothing that is known yet: one stands on the height one has.
        fall_ = 0;
    }
    if (frame.height() < height) frame.grow(std::min(height - frame.height(), rise));

    height_ = frame.height();
    if (frame.eye() != Vec3d::Zero()) eye_ += scale_ * frame.eye();
    return eye_;
}

}  // namespace tessera
