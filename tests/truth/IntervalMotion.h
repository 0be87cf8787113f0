/// A body's way in interval arithmetic (Boost.Interval): where its points and their velocities are during a span of
/// time, for certain. Nothing of it is the library's but what a BodyMotion means: translation and scale linear,
/// rotation by slerp along the shorter arc.
///
/// For files that are compiled with -frounding-math, while a `Rounding` lives: from there to its end the processor
/// rounds upwards.
#pragma once

#include <array>
#include <boost/numeric/interval.hpp>
#include <cmath>

#include "server/collision/query/TimeOfImpact.h"

namespace tessera::truth {

using Rounding = boost::numeric::interval<double>::traits_type::rounding;
using Interval = boost::numeric::interval_lib::unprotect<boost::numeric::interval<double>>::type;

struct IVec {
    Interval x, y, z;

    IVec() : x(0), y(0), z(0) {}
    IVec(const Interval& a, const Interval& b, const Interval& c) : x(a), y(b), z(c) {}
    explicit IVec(const Vec3d& v) : x(v.x()), y(v.y()), z(v.z()) {}
    [[nodiscard]] Vec3d middle() const { return {median(x), median(y), median(z)}; }
};
inline IVec operator+(const IVec& a, const IVec& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline IVec operator-(const IVec& a, const IVec& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline IVec operator*(const Interval& s, const IVec& v) {
    return {s * v.x, s * v.y, s * v.z};
}
inline Interval dot(const IVec& a, const IVec& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Interval dot(const Vec3d& a, const IVec& b) {
    return a.x() * b.x + a.y() * b.y + a.z() * b.z;
}
inline IVec cross(const IVec& a, const IVec& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline IVec times(const IVec& a, const IVec& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

/// sin and cos of something within 0 … 4, by Taylor's series of a quarter of it, whose rest is smaller than the term
/// left out.
struct Angle {
    Interval sine, cosine;

    explicit Angle(const Interval& angle) {
        const Interval y = angle / Interval(4.0), square = y * y;
        constexpr int kTerms = 13;  // 27! is about 1e28
        Interval s(-1e-27, 1e-27), c(-1e-26, 1e-26);
        for (int k = kTerms; k-- > 0;) {
            s = Interval(1) - square * s / Interval((2.0 * k + 2) * (2 * k + 3));
            c = Interval(1) - square * c / Interval((2.0 * k + 1) * (2 * k + 2));
        }
        sine = y * s;
        cosine = c;
        for (int doubling = 0; doubling < 2; ++doubling) {
            const Interval both = Interval(2) * sine * cosine;
            cosine = Interval(1) - Interval(2) * sine * sine;
            sine = both;
        }
    }
};

class IntervalWay {
public:
    explicit IntervalWay(const BodyMotion& motion) {
        t0_ = IVec(motion.start.translation);
        dt_ = IVec(motion.end.translation) - t0_;
        s0_ = IVec(motion.start.scale);
        ds_ = IVec(motion.end.scale) - s0_;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column)
                mesh_[at(row)][at(column)] = motion.body_T_mesh.linear()(row, column);
            meshShift_[at(row)] = motion.body_T_mesh.translation()[row];
        }
        const Quaternion from = unit(motion.start.rotation);
        Quaternion to = unit(motion.end.rotation);
        rows_ = matrixOf(from);
        if (motion.start.rotation.coeffs() == motion.end.rotation.coeffs()) return;
        turns_ = true;
        const Interval cosine = from.w * to.w + dot(from.v, to.v);
        if (!(cosine.lower() > 0) && !(cosine.upper() < 0))
            throw std::domain_error("half a turn: either arc is the shorter one");
        if (cosine.upper() < 0) to = {-to.w, Interval(-1) * to.v};
        // to · conjugate(from)
        const IVec v = from.w * to.v - to.w * from.v - cross(to.v, from.v);
        const Interval w = to.w * from.w + dot(to.v, from.v), sine = sqrt(dot(v, v));
        axis_ = {v.x / sine, v.y / sine, v.z / sine};
        angle_ = Interval(2) * arcOf(sine, w);
    }

    /// A vertex in the body's own frame, which moves.
    [[nodiscard]] IVec inBody(const Vec3d& x) const {
        const IVec p(x);
        const auto row = [&](std::size_t i) {
            return mesh_[i][0] * p.x + mesh_[i][1] * p.y + mesh_[i][2] * p.z + meshShift_[i];
        };
        return {row(0), row(1), row(2)};
    }
    [[nodiscard]] bool turns() const { return turns_; }
    [[nodiscard]] const Interval& angle() const { return angle_; }
    [[nodiscard]] const IVec& axis() const { return axis_; }
    [[nodiscard]] IVec scaleAt(const Interval& t) const { return s0_ + t * ds_; }
    [[nodiscard]] const IVec& scaling() const { return ds_; }
    [[nodiscard]] IVec originAt(const Interval& t, const IntervalWay& from) const {
        return (t0_ - from.t0_) + t * (dt_ - from.dt_);
    }
    [[nodiscard]] IVec drift(const IntervalWay& from) const { return dt_ - from.dt_; }

    using Rows = std::array<IVec, 3>;
    /// R(t): Rodrigues' formula.
    [[nodiscard]] Rows rotationAt(const Interval& t) const {
        if (!turns_) return rows_;
        const Angle a(t * angle_);
        const Interval versine = Interval(1) - a.cosine;
        const Interval x = axis_.x, y = axis_.y, z = axis_.z;
        const Rows turn{IVec{a.cosine + versine * x * x, versine * x * y - a.sine * z, versine * x * z + a.sine * y},
                        IVec{versine * x * y + a.sine * z, a.cosine + versine * y * y, versine * y * z - a.sine * x},
                        IVec{versine * x * z - a.sine * y, versine * y * z + a.sine * x, a.cosine + versine * z * z}};
        const Rows columns = transposed(rows_);
        Rows out;
        for (std::size_t i = 0; i < 3; ++i)
            out[i] = {dot(turn[i], columns[0]), dot(turn[i], columns[1]), dot(turn[i], columns[2])};
        return out;
    }
    [[nodiscard]] static Rows transposed(const Rows& m) {
        return {IVec{m[0].x, m[1].x, m[2].x}, IVec{m[0].y, m[1].y, m[2].y}, IVec{m[0].z, m[1].z, m[2].z}};
    }

private:
    struct Quaternion {
        Interval w;
        IVec v;
    };
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    static Quaternion unit(const Quatd& q) {
        const IVec v(q.vec());
        const Interval length = sqrt(Interval(q.w()) * q.w() + dot(v, v));
        return {Interval(q.w()) / length, {v.x / length, v.y / length, v.z / length}};
    }
    static Rows matrixOf(const Quaternion& q) {
        const Interval two(2), one(1);
        const IVec& v = q.v;
        return {
            IVec{one - two * (v.y * v.y + v.z * v.z), two * (v.x * v.y - q.w * v.z), two * (v.x * v.z + q.w * v.y)},
            IVec{two * (v.x * v.y + q.w * v.z), one - two * (v.x * v.x + v.z * v.z), two * (v.y * v.z - q.w * v.x)},
            IVec{two * (v.x * v.z - q.w * v.y), two * (v.y * v.z + q.w * v.x), one - two * (v.x * v.x + v.y * v.y)}};
    }
    /// atan2(sine, cosine) within 0 … π/2: a guess, and proof that it is between two neighbours.
    static Interval arcOf(const Interval& sine, const Interval& cosine) {
        const double guess = std::atan2(median(sine), median(cosine));
        for (double off = 0x1p-52;; off *= 2) {
            const double low = std::max(0.0, guess - off), high = guess + off;
            const Angle below{Interval(low)}, above{Interval(high)};
            const Interval before = below.sine * cosine - below.cosine * sine,
                           after = above.sine * cosine - above.cosine * sine;
            if ((low == 0 || before.upper() < 0) && after.lower() > 0) return {low, high};
            if (off > 1) throw std::domain_error("no arc");
        }
    }

    IVec t0_, dt_, s0_, ds_;
    Rows rows_;
    std::array<std::array<Interval, 3>, 3> mesh_;
    std::array<Interval, 3> meshShift_;
    IVec axis_;
    Interval angle_{0};
    bool turns_ = false;
};

}  // namespace tessera::truth
