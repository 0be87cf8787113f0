#include "tests/truth/ImpactTrials.h"

#include <array>
#include <cmath>
#include <stdexcept>

namespace tessera::truth {
namespace {

using bodies::Body;

Body tetrahedron() {
    Body out;
    for (const Vec3d& p : {Vec3d(1, 1, 1), Vec3d(1, -1, -1), Vec3d(-1, 1, -1), Vec3d(-1, -1, 1)}) out.vertex(0.6 * p);
    out.indices = {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
    return out;
}

/// Triangles that have area.
Body shards(Random& random, int count) {
    Body out;
    for (int i = 0; i < count; ++i) {
        const Vec3d middle = random.uniform(0, 0.7) * random.direction();
        std::uint32_t corner[3];
        for (std::uint32_t& c : corner) c = out.vertex(middle + 0.4 * random.direction());
        out.face(corner[0], corner[1], corner[2]);
    }
    return out;
}

/// Mostly small ones; at times a larger one, whose tree has levels, and one of a few faces.
void chooseBodies(Random& random, Trial& trial) {
    constexpr std::array kKinds{VolumeKind::kObb,   VolumeKind::kSphere, VolumeKind::kAabb, VolumeKind::kDop6,
                                VolumeKind::kDop14, VolumeKind::kDop18,  VolumeKind::kDop26};
    trial.volume = kKinds[static_cast<std::size_t>(random.whole(0, 6))];
    trial.a = random.whole(0, 5) == 0 ? bodies::torus(0.6, 0.2, 14, 10) : anyBody(random);
    trial.b = trial.a.indices.size() > 3 * 60 ? tetrahedron() : anyBody(random);
}

double toleranceOf(Random& random) {
    constexpr std::array<double, 4> kTolerances{1e-3, 1e-4, 1e-9, 0};
    return kTolerances[static_cast<std::size_t>(random.whole(0, 3))];
}

/// From a distance to the other side of the origin, or past it.
void send(Random& random, BodyMotion& m, double from, double past, double turn) {
    const Vec3d d = random.direction(),
                aside = random.whole(0, 1) * random.uniform(0.5, 1.6) * d.cross(random.direction()).normalized();
    m.start.translation = from * d + aside;
    m.end.translation = -random.uniform(0.2, 1) * from * d + past * random.direction() + aside;
    m.start.rotation = random.rotation();
    m.end.rotation = random.turn(turn) * m.start.rotation;
}

struct Feature {
    Vec3d point;  ///< of the mesh, exact
    Vec3d out;    ///< away from the body, about
};

/// A corner, the middle of an edge, or a point within a face.
Feature featureOf(const Body& body, Random& random) {
    const auto faces = static_cast<int>(body.indices.size() / 3);
    const auto face = static_cast<std::size_t>(3 * random.whole(0, faces - 1));
    std::array<Vec3d, 3> c;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t v = 3 * std::size_t{body.indices[face + i]};
        c[i] = {body.positions[v], body.positions[v + 1], body.positions[v + 2]};
    }
    Vec3d out = (c[1] - c[0]).cross(c[2] - c[0]);
    const double corners = random.whole(0, 2);
    if (corners == 0) return {c[0], c[0] + 0.1 * random.direction()};
    if (corners == 1) return {0.5 * (c[0] + c[1]), out + 0.3 * random.direction()};
    return {0.25 * c[0] + 0.25 * c[1] + 0.5 * c[2], out};
}

Vec3d evenPowers(Random& random) {
    if (random.whole(0, 1) == 0) return Vec3d::Ones();
    return {std::ldexp(1, random.whole(-1, 1)), std::ldexp(1, random.whole(-1, 1)), std::ldexp(1, random.whole(-1, 1))};
}

/// How far a feature's contact leaves the two before they move, along the normal.
Trial startingTogether(std::uint64_t seed, bool gap) {
    Random random(seed);
    Trial trial;
    trial.tolerance = toleranceOf(random);
    const Quatd rotationA = random.wholeRotation(), rotationB = random.wholeRotation();
    chooseBodies(random, trial);
    trial.a = snapped(trial.a, rotationA.squaredNorm());
    trial.b = snapped(trial.b, rotationB.squaredNorm());
    const Feature onA = featureOf(trial.a, random), onB = featureOf(trial.b, random);
    BodyMotion &a = trial.motionA, &b = trial.motionB;
    a.start = {.translation = Vec3d(random.whole(-8, 8), random.whole(-8, 8), random.whole(-8, 8)) / 4,
               .rotation = rotationA,
               .scale = evenPowers(random)};
    b.start = {.rotation = rotationB, .scale = evenPowers(random)};
    // Turning about the contact: the mesh sits in the body so that the contact is its origin.
    const bool pivots = random.whole(0, 3) == 0;
    const Vec3d ownB = pivots ? Vec3d(Vec3d::Zero()) : onB.point;
    if (pivots) b.body_T_mesh.translation() = -onB.point;
    const auto number = [](const RationalPoint& p) {
        return Vec3d(p.x.convert_to<double>(), p.y.convert_to<double>(), p.z.convert_to<double>());
    };
    const Vec3d contact = number(placed(a.start, exactly(onA.point)));
    b.start.translation = contact - number(placed(b.start, exactly(ownB)));
    if (!(placed(a.start, exactly(onA.point)) == placed(b.start, exactly(ownB))))
        throw std::logic_error("not in touch as they begin");
    Vec3d normal = a.start.rotation.normalized() * a.start.scale.cwiseInverse().cwiseProduct(onA.out);
    if (!(normal.norm() > 0)) normal = random.direction();
    normal.normalize();
    if (gap) b.start.translation += std::pow(10.0, random.uniform(-12, -2)) * normal;
    a.end = a.start;
    b.end = b.start;
    const Vec3d along = normal.cross(random.direction()).normalized();
    const int kind = random.whole(0, 5);
    const auto names = std::array{"parts", "slides", "presses", "tumbles", "swings back", "both move"};
    trial.what = names[static_cast<std::size_t>(kind)];
    if (kind == 0) b.end.translation += random.uniform(0.1, 2) * (normal + 0.3 * along);
    if (kind == 1) b.end.translation += random.uniform(0.1, 2) * along;
    if (kind == 2) b.end.translation += random.uniform(1e-3, 1) * (along - random.uniform(0, 2) * normal);
    if (kind >= 3) {
        b.end.rotation = random.turn(kind == 4 ? 3 : 1) * b.start.rotation.normalized();
        b.end.translation += random.uniform(0, 0.5) * random.direction();
    }
    if (kind == 5) {
        a.end.rotation = random.turn(1) * a.start.rotation.normalized();
        a.end.translation += random.uniform(0, 0.5) * random.direction();
        a.end.scale *= random.uniform(0.7, 1.4);
    }
    return trial;
}

}  // namespace

Body snapped(Body body, double norm) {
    const double cell = norm * 0x1p-22;
    for (double& x : body.positions) x = cell * std::round(x / cell);
    return body;
}

Body anyBody(Random& random) {
    switch (random.whole(0, 8)) {
        case 0:
            return bodies::sheet(random.uniform(0.3, 2), random.uniform(0.3, 2));
        case 1:
            return tetrahedron();
        case 2:
        case 3:
            return bodies::box(Vec3d(random.uniform(0.2, 1.5), random.uniform(0.2, 1.5), random.uniform(0.2, 1.5)));
        case 4:
            return bodies::box(Vec3d(1.5, 1, 1e-3));  // a plate
        case 5:
            return bodies::box(Vec3d(0.02, 0.02, 2));  // a rod
        case 6:
            return shards(random, random.whole(2, 12));
        case 7:
            return bodies::sphere(0.7, 4, 6);
        default:
            return bodies::torus(0.6, 0.2, 6, 5);
    }
}

Quatd Random::wholeRotation() {
    if (whole(0, 2) == 0) return Quatd::Identity();
    Quatd q(0, 0, 0, 0);
    while (q.squaredNorm() == 0)
        for (double* x : {&q.w(), &q.x(), &q.y(), &q.z()}) *x = whole(-4, 4);
    return q;
}

Vec3d Random::direction() {
    while (true) {
        const double x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
        const Vec3d v(x, y, z);
        if (v.squaredNorm() <= 1 && v.squaredNorm() > 1e-4) return v.normalized();
    }
}

double Trial::extent() const {
    const auto of = [](const Body& body, const BodyMotion& m) {
        double reach = 0;
        for (std::size_t v = 0; v < body.positions.size(); v += 3)
            reach = std::max(
                reach, (m.body_T_mesh * Vec3d(body.positions[v], body.positions[v + 1], body.positions[v + 2])).norm());
        return std::max(m.start.translation.norm(), m.end.translation.norm()) +
               reach * std::max(m.start.scale.cwiseAbs().maxCoeff(), m.end.scale.cwiseAbs().maxCoeff());
    };
    return of(a, motionA) + of(b, motionB);
}

Trial freeTrial(Moves moves, std::uint64_t seed) {
    Random random(seed + 1'000'000 * static_cast<std::uint64_t>(moves));
    Trial trial;
    trial.what = "moves " + std::to_string(static_cast<int>(moves));
    trial.tolerance = toleranceOf(random);
    chooseBodies(random, trial);
    BodyMotion &a = trial.motionA, &b = trial.motionB;
    const double turn = random.whole(0, 2) == 0 ? 3.1 : 1;
    send(random, b, random.uniform(1.6, 2.6), 1.2, turn);
    a.start.rotation = a.end.rotation = random.rotation();
    if (moves != Moves::kScrew && moves != Moves::kOrbit && moves != Moves::kArc) send(random, a, 0.5, 0.5, turn);
    for (BodyMotion* m : {&a, &b}) {
        if (moves == Moves::kScale) {
            m->start.scale = Vec3d::Constant(random.uniform(0.5, 1.5));
            m->end.scale = Vec3d::Constant(random.uniform(0.2, 2));
        }
        if (moves == Moves::kStretch)
            for (int k = 0; k < 3; ++k) {
                m->start.scale[k] = random.uniform(0.3, 1.7);
                m->end.scale[k] = random.whole(0, 4) == 0 ? random.uniform(-1, 0) : random.uniform(0.3, 1.7);
            }
        if (moves == Moves::kOrbit) {
            for (int i = 0; i < 9; ++i)
                m->body_T_mesh.linear()(i / 3, i % 3) += random.whole(0, 1) * random.uniform(-0.4, 0.4);
            if (random.whole(0, 1) == 0) m->body_T_mesh.linear().col(0) *= -1;
            m->body_T_mesh.translation() = random.uniform(0, 2) * random.direction();
        }
    }
    if (moves == Moves::kArc) {
        const double radius = random.uniform(2, 8), angle = random.uniform(0.8, 3),
                     place = random.uniform(0.2, 0.9) * angle;
        const double inner = radius - random.uniform(0.1, 1.6);
        const Vec3d axis = a.start.rotation * Vec3d::UnitZ();
        a.start.translation = a.end.translation = b.start.translation = random.uniform(0, 2) * random.direction();
        b.end.translation = b.start.translation + random.uniform(0, 0.1) * random.direction();
        b.start.rotation = a.start.rotation;
        b.end.rotation = Quatd(Eigen::AngleAxisd(angle, axis)) * b.start.rotation;
        a.body_T_mesh = Eigen::Translation3d(inner * std::cos(place), inner * std::sin(place), 0) * random.rotation();
        b.body_T_mesh = Eigen::Translation3d(radius, 0, 0) * random.rotation();
    }
    if (moves == Moves::kFar) {
        const double size = std::pow(10.0, random.whole(-3, 3));
        const Vec3d away = std::pow(10.0, random.whole(0, 5)) * random.direction();
        for (BodyMotion* m : {&a, &b})
            for (Pose* p : {&m->start, &m->end}) {
                p->translation = size * (p->translation + away);
                p->scale *= size;
            }
        trial.tolerance *= size;
    }
    return trial;
}

Trial touchingTrial(std::uint64_t seed) {
    return startingTogether(seed, false);
}
Trial nearTrial(std::uint64_t seed) {
    return startingTogether(seed, true);
}

Trial latticeTrial(std::uint64_t seed) {
    Random random(seed);
    Trial trial;
    trial.what = "lattice";
    trial.tolerance = toleranceOf(random);
    const auto spot = [&](int most) -> Vec3d {
        const double x = random.whole(-most, most), y = random.whole(-most, most), z = random.whole(-most, most);
        return {x, y, z};
    };
    const auto body = [&] {
        if (random.whole(0, 1) == 0)
            return bodies::box(Vec3d(random.whole(1, 3), random.whole(1, 3), random.whole(1, 3)));
        Body out;
        for (int faces = random.whole(1, 4); faces > 0;) {
            const Vec3d p = spot(2), q = spot(2), r = spot(2);
            if ((q - p).cross(r - p).isZero(0)) continue;
            const std::uint32_t at[] = {out.vertex(p), out.vertex(q), out.vertex(r)};
            out.face(at[0], at[1], at[2]);
            --faces;
        }
        return out;
    };
    trial.a = body();
    trial.b = body();
    const bool upright = random.whole(0, 2) > 0;
    for (BodyMotion* m : {&trial.motionA, &trial.motionB}) {
        m->start.rotation = upright ? Quatd::Identity() : random.wholeRotation();
        m->end.rotation = m->start.rotation;
        m->start.translation = spot(m == &trial.motionA ? 1 : 5);
        m->end.translation = m == &trial.motionA ? Vec3d(m->start.translation + random.whole(0, 1) * spot(2)) : spot(5);
    }
    return trial;
}

}  // namespace tessera::truth
