#include "server/collision/query/BodyWay.h"

#include <algorithm>
#include <cmath>

#include "common/math/Decompositions.h"

namespace tessera {
namespace {

Mat3d crossMatrix(const Vec3d& v) {
    Mat3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

bool usable(const Pose& pose) {
    const double norm = pose.rotation.coeffs().norm();
    return pose.translation.allFinite() && pose.scale.allFinite() && std::isfinite(norm) && norm > 1e-100;
}

bool uniform(const Vec3d& scale) {
    const Vec3d size = scale.cwiseAbs();
    return size.x() == size.y() && size.y() == size.z();
}

/// Of a map that turns, mirrors and scales evenly: the scale. 0 of any other.
double evenScale(const Mat3d& m) {
    const Mat3d square = m.transpose() * m;
    const double s2 = square.trace() / 3;
    // What the kernels' floats cannot tell from even.
    return (square - s2 * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-9 * s2 ? std::sqrt(s2) : 0;
}

}  // namespace

BodyWay::BodyWay(const BodyMotion& motion) {
    valid_ = usable(motion.start) && usable(motion.end) && motion.body_T_mesh.matrix().allFinite();
    if (!valid_) return;
    start_ = motion.start.rotation.normalized();
    Quatd end = motion.end.rotation.normalized();
    if (start_.dot(end) < 0) end.coeffs() = -end.coeffs();  // the shorter arc
    const bool turns = start_.coeffs() != end.coeffs();
    const Quatd turn = turns ? end * start_.conjugate() : Quatd::Identity();
    const double sine = turn.vec().norm();
    if (sine > 0) {
        axis_ = turn.vec() / sine;
        angle_ = 2 * std::atan2(sine, turn.w());
    }
    r_ = start_.toRotationMatrix();
    kr_ = crossMatrix(axis_) * r_;
    kkr_ = crossMatrix(axis_) * kr_;
    shift0_ = motion.start.translation;
    shift_ = motion.end.translation - shift0_;
    scale0_ = motion.start.scale;
    scale_ = motion.end.scale - scale0_;
    stretch_ = std::max(motion.start.scale.cwiseAbs().maxCoeff(), motion.end.scale.cwiseAbs().maxCoeff());
    swelling_ = scale_.cwiseAbs().maxCoeff();
    // Of a scale that turns inside out on the way the three would have to pass zero together.
    similarity_ = uniform(motion.start.scale) && uniform(motion.end.scale) && uniform(scale_);
    innerLinear_ = motion.body_T_mesh.linear();
    innerShift_ = motion.body_T_mesh.translation();
    inner_ = innerLinear_ != Mat3d::Identity() || innerShift_ != Vec3d::Zero();
    if (inner_) {
        innerStretch_ = stretchOf(innerLinear_);
        innerScale_ = evenScale(innerLinear_);
        similarity_ = similarity_ && innerScale_ > 0;
    }
    wholeStretch_ = stretch_ * innerStretch_;
    wholeSwelling_ = swelling_ * innerStretch_;
    wholeTurn_ = (angle_ * stretch_ + swelling_) * innerStretch_;
    for (const BodyMotion& carrier : motion.carriers) carriers_.emplace_back(carrier);
    addCarriers();
}

/// The product rule, from the body up: a point that is `radius` from a frame's origin, with its speed and acceleration
/// there, seen from the frame above.
void BodyWay::addCarriers() {
    if (!carried()) return;
    const double ownTurn = angle_ * stretch_ + swelling_, ownBend = angle_ * angle_ * stretch_ + 2 * angle_ * swelling_;
    Bound radius{std::max(shift0_.norm(), (shift0_ + shift_).norm()), stretch_};
    turnsDirections_ = keepsSides();
    speed_ = {shift_.norm(), ownTurn};
    bend_ = {0, ownBend};
    for (auto carrier = carriers_.rbegin(); carrier != carriers_.rend(); ++carrier) {
        const BodyWay& c = *carrier;
        valid_ = valid_ && c.valid_;
        similarity_ = similarity_ && c.similarity_;
        turnsDirections_ = turnsDirections_ && c.keepsSides();
        wholeSwelling_ = c.wholeSwelling_ * wholeStretch_ + c.wholeStretch_ * wholeSwelling_;
        wholeTurn_ = c.wholeTurn_ * wholeStretch_ + c.wholeStretch_ * wholeTurn_;
        wholeStretch_ *= c.wholeStretch_;
        radius = c.innerStretch_ * radius + Bound{c.innerShift_.norm(), 0};
        const Bound speed = c.innerStretch_ * speed_, bend = c.innerStretch_ * bend_;
        const double turn = c.angle_ * c.stretch_ + c.swelling_,
                     turnOfTurn = c.angle_ * c.angle_ * c.stretch_ + 2 * c.angle_ * c.swelling_;
        bend_ = turnOfTurn * radius + 2 * turn * speed + c.stretch_ * bend;
        speed_ = Bound{c.shift_.norm(), 0} + turn * radius + c.stretch_ * speed;
        radius = Bound{std::max(c.shift0_.norm(), (c.shift0_ + c.shift_).norm()), 0} + c.stretch_ * radius;
    }
    // Sums of a dozen products each.
    for (Bound* bound : {&speed_, &bend_}) *bound = (1 + 1e-12) * *bound;
}

/// Each map's stretch is convex, so below the line between its ends; a product of lines bends upwards at most by the
/// pairs whose slopes have different signs.
double BodyWay::stretchAboveChord() const {
    struct Line {
        double most, slope;
    };
    std::vector<Line> lines;
    const auto add = [&](const BodyWay& way) {
        const double start = way.scale0_.cwiseAbs().maxCoeff() * way.innerStretch_,
                     end = (way.scale0_ + way.scale_).cwiseAbs().maxCoeff() * way.innerStretch_;
        lines.push_back({std::max(start, end), end - start});
    };
    add(*this);
    for (const BodyWay& carrier : carriers_) add(carrier);
    double bend = 0;
    for (std::size_t i = 0; i < lines.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            double pair = std::max(0.0, -2 * lines[i].slope * lines[j].slope);
            for (std::size_t k = 0; k < lines.size() && pair > 0; ++k)
                if (k != i && k != j) pair *= lines[k].most;
            bend += pair;
        }
    return bend / 8;
}

BodyWay::Turned BodyWay::turned(const Vec3d& atStart, double t) const {
    if (!carried()) {
        const Vec3d n = Eigen::AngleAxisd(t * angle_, axis_) * atStart;
        return {n, angle_ * axis_.cross(n), angle_};
    }
    double turn = angle_;
    for (const BodyWay& carrier : carriers_) turn += carrier.angle_;
    const BodyMoment start = at(0), now = at(t);
    // Of a similarity, whose inverse is its transpose but for the scale.
    const Vec3d own = start.linear.transpose() * atStart, n = now.linear * own, rate = now.turning * own;
    const double length = n.norm();
    const Vec3d unit = n / length;
    return {unit, (rate - unit.dot(rate) * unit) / length, turn};
}

Quatd BodyWay::rotationAt(double t) const {
    return Quatd(Eigen::AngleAxisd(t * angle_, axis_)) * start_;
}

BodyMoment BodyWay::at(double t) const {
    BodyMoment m;
    const double s = std::sin(0.5 * t * angle_), c = std::cos(0.5 * t * angle_);
    const double sine = 2 * s * c, versine = 2 * s * s;
    const Vec3d scale = scale0_ + t * scale_;
    const Mat3d rotation = r_ + sine * kr_ + versine * kkr_;
    const Mat3d rate = angle_ * ((1 - versine) * kr_ + sine * kkr_);
    m.linear = rotation * scale.asDiagonal();
    m.translation = shift0_ + t * shift_;
    m.turning = rate * scale.asDiagonal();
    m.turning += rotation * scale_.asDiagonal();
    m.drift = shift_;
    if (inner_) {
        m.translation += m.linear * innerShift_;
        m.drift += m.turning * innerShift_;
        m.linear *= innerLinear_;
        m.turning *= innerLinear_;
    }
    for (auto carrier = carriers_.rbegin(); carrier != carriers_.rend(); ++carrier) {
        const BodyMoment outer = carrier->at(t);
        m.drift = outer.turning * m.translation + outer.linear * m.drift + outer.drift;
        m.translation = outer.linear * m.translation + outer.translation;
        m.turning = outer.turning * m.linear + outer.linear * m.turning;
        m.linear = outer.linear * m.linear;
    }
    return m;
}

double BodyWay::extent(double reach) const {
    double extent = std::max(shift0_.cwiseAbs().maxCoeff(), (shift0_ + shift_).cwiseAbs().maxCoeff()) +
                    stretch_ * (innerStretch_ * reach + innerShift_.norm());
    for (auto carrier = carriers_.rbegin(); carrier != carriers_.rend(); ++carrier)
        extent = carrier->extent(std::sqrt(3.0) * extent);
    return static_cast<double>(1 + carriers_.size()) * extent;
}

Pose BodyMotion::at(double t) const {
    if (t <= 0) return start;
    if (t >= 1) return end;
    const BodyWay way(*this);
    return {start.translation + t * (end.translation - start.translation), way.rotationAt(t),
            start.scale + t * (end.scale - start.scale)};
}

Affine3d BodyMotion::placeAt(double t) const {
    Affine3d place = at(t).matrix() * body_T_mesh;
    for (auto carrier = carriers.rbegin(); carrier != carriers.rend(); ++carrier)
        place = carrier->at(t).matrix() * carrier->body_T_mesh * place;
    return place;
}

}  // namespace tessera
