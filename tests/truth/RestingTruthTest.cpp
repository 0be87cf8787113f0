// Bodies that rest on a floor as they begin, and the supports that let them slide, beside certain bounds
// (MotionOracle.h).
//
// What is clear of all else and goes along its floor or away from it must not be stopped, nor when the floor falls away
// as a trapdoor does. Nobody may, before the moment of a hit, pierce any face deeper along the support than the support
// allows.
//
// TESSERA_HUNT=N: so many times as many trials. TESSERA_SEED=n: of each kind that one alone.
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <sstream>

#include "tests/truth/ImpactTrials.h"
#include "tests/truth/MotionOracle.h"

namespace tessera {
namespace {

using bodies::Body;
using truth::MovingBodies;

constexpr double kTolerance = 1e-5, kOverlap = 1e-4, kRounding = 1e-10;

enum class Goes { kAlong, kTurningAlong, kAway, kTrapdoor, kCarried, kPressed, kTilting, kOutOfTheFloor };
constexpr const char* kNames[] = {"Along",   "TurningAlong", "Away",    "Trapdoor",
                                  "Carried", "Pressed",      "Tilting", "OutOfTheFloor"};

struct Hall {
    Body floor, walls, mover;
    BodyMotion motionA, motionB;
    Vec3d up = Vec3d::UnitZ();
    double sunk = 0;
    std::vector<Support> supports;
    std::vector<FacePair> within;

    [[nodiscard]] Body all() const { return floor.with(walls); }
    [[nodiscard]] MovingBodies moving() const { return {all().mesh(), motionA, mover.mesh(), motionB}; }
    [[nodiscard]] Impact answer() const {
        QueryWork work;
        return timeOfImpact(all().tree(), motionA, mover.tree(), motionB, work,
                            {.tolerance = kTolerance, .supports = supports, .within = within});
    }
};

/// Turned as it comes, or as it is made, its lowest point or points exactly in z = 0.
Body standing(truth::Random& random, double cell) {
    Body body = random.whole(0, 3) == 0 ? bodies::torus(0.6, 0.2, 6, 5) : truth::anyBody(random);
    if (random.whole(0, 1) == 0) {
        const Quatd turn = random.rotation();
        for (std::size_t v = 0; v < body.positions.size(); v += 3) {
            const Vec3d p = turn * Vec3d(body.positions[v], body.positions[v + 1], body.positions[v + 2]);
            for (int k = 0; k < 3; ++k) body.positions[v + static_cast<std::size_t>(k)] = p[k];
        }
    }
    body = truth::snapped(body, cell);
    double lowest = body.positions[2];
    for (std::size_t v = 2; v < body.positions.size(); v += 3) lowest = std::min(lowest, body.positions[v]);
    return body.moved(Vec3d(0, 0, -lowest));
}

Hall hallOf(Goes goes, std::uint64_t seed) {
    truth::Random random(seed + 1'000'000 * static_cast<std::uint64_t>(goes));
    const Quatd q = random.wholeRotation();
    const double norm = q.squaredNorm();
    const auto onLattice = [&](double x) { return norm * 0x1p-10 * std::round(x * 0x1p10 / norm); };
    const auto flat = [&](double most) -> Vec3d {
        const double x = onLattice(random.uniform(-most, most)), y = onLattice(random.uniform(-most, most));
        return {x, y, 0};
    };
    Hall hall;
    hall.floor = truth::snapped(random.whole(0, 1) ? bodies::grid(static_cast<std::uint32_t>(random.whole(1, 4)), 8)
                                                   : bodies::box(Vec3d(8, 8, 1)).moved(Vec3d(0, 0, -0.5)),
                                norm);
    double top = hall.floor.positions[2];
    for (std::size_t v = 2; v < hall.floor.positions.size(); v += 3) top = std::max(top, hall.floor.positions[v]);
    hall.floor = hall.floor.moved(Vec3d(0, 0, -top));
    for (int walls = random.whole(0, 3); walls > 0; --walls) {
        const double height = random.uniform(0.05, 1.5);
        Body wall = bodies::box(Vec3d(random.uniform(0.001, 0.6), random.uniform(0.1, 3), height));
        hall.walls = hall.walls.with(
            truth::snapped(wall.moved(Vec3d(0, 0, 0.5 * height - random.whole(0, 1) * 0.25)), norm).moved(flat(3.5)));
    }
    hall.mover = standing(random, norm);
    if (goes == Goes::kOutOfTheFloor) hall.sunk = onLattice(random.uniform(0.05, 0.3));
    const Vec3d at = flat(3) - Vec3d(0, 0, hall.sunk);
    BodyMotion &a = hall.motionA, &b = hall.motionB;
    a.start.rotation = b.start.rotation = q;
    const auto turned = [&](const Vec3d& v) -> Vec3d {  // exact, of a lattice of `norm`
        const auto p = truth::placed({.rotation = q}, truth::exactly(v));
        return {p.x.convert_to<double>(), p.y.convert_to<double>(), p.z.convert_to<double>()};
    };
    hall.up = q.normalized() * Vec3d::UnitZ();
    if (goes == Goes::kCarried) {
        b.body_T_mesh.translation() = at;
    } else {
        b.start.translation = turned(at);
    }
    if (goes == Goes::kTrapdoor) {  // the hinge: a line along y that the mover stands beyond
        double least = 0;
        for (std::size_t v = 0; v < hall.mover.positions.size(); v += 3)
            least = std::min(least, hall.mover.positions[v]);
        const Vec3d hinge = at + Vec3d(least - onLattice(random.uniform(0.1, 1)), 0, 0);
        a.body_T_mesh.translation() = -hinge;
        a.start.translation = turned(hinge);
    }
    a.end = a.start;
    b.end = b.start;
    const Vec3d along = turned(flat(4));
    const double rises = random.uniform(0.001, 2);
    switch (goes) {
        case Goes::kTurningAlong:
            b.end.rotation = Quatd(Eigen::AngleAxisd(random.uniform(-3, 3), hall.up)) * q.normalized();
            [[fallthrough]];
        case Goes::kAlong:
            b.end.translation += along;
            break;
        case Goes::kAway:
            b.end.translation += along + rises * hall.up;
            break;
        case Goes::kPressed:
            b.end.translation += along - std::pow(10, random.uniform(-6, 0)) * hall.up;
            break;
        case Goes::kTilting:
            b.end.rotation = random.turn(1) * q.normalized();
            b.end.translation += along + random.uniform(-0.2, 0.5) * hall.up;
            break;
        case Goes::kTrapdoor:
            a.end.rotation =
                Quatd(Eigen::AngleAxisd(random.uniform(0.01, 1.5), q.normalized() * Vec3d::UnitY())) * q.normalized();
            break;
        case Goes::kCarried:
            b.end.rotation = a.end.rotation = random.turn(3) * q.normalized();
            b.end.translation = a.end.translation = 2 * random.direction();
            break;
        case Goes::kOutOfTheFloor:
            b.end.translation += random.uniform(0, 2) * along.norm() * hall.up;
            if (random.whole(0, 1) == 0) b.end.translation += turned(Vec3d(0.5 * along.x(), 0.5 * along.y(), 0));
            break;
    }
    Support support{.normal = hall.up, .overlap = kOverlap, .rounding = kRounding};
    if (goes == Goes::kTrapdoor || goes == Goes::kCarried) {
        hall.supports.push_back(support);
        support.turns = Support::Turns::kWithA;
    }
    if (hall.sunk > 0) {
        support.overlap = hall.sunk + kOverlap;
        support.parting = true;
        hall.within = hall.moving().near(0);
    }
    hall.supports.push_back(support);
    return hall;
}

/// The mover does not come near the walls, and so has nothing to be stopped by.
bool clear(const Hall& hall) {
    if (hall.walls.indices.empty()) return true;
    return MovingBodies(hall.walls.mesh(), hall.motionA, hall.mover.mesh(), hall.motionB)
        .apart(0, 1, 1.001 * kTolerance);
}

bool mustGo(Goes goes, const Hall& hall) {
    const Vec3d way = hall.motionB.end.translation - hall.motionB.start.translation;
    // On a slant it comes from below at parts of the floor that it was not in.
    if (goes == Goes::kOutOfTheFloor) return way.cross(hall.up).norm() < 1e-9 && clear(hall);
    return goes != Goes::kPressed && goes != Goes::kTilting && goes != Goes::kCarried && clear(hall);
}

/// What is wrong with an answer; nothing where nothing is.
std::string wrong(Goes goes, const Hall& hall, const Impact& found) {
    std::ostringstream out;
    out.precision(17);
    // What turns and rests on what turns with it takes more steps than there are.
    if (!found.complete && goes != Goes::kCarried) return "incomplete";
    if (found.hit && mustGo(goes, hall))
        out << "stopped at " << found.t << " by support " << found.support << ", faces " << found.faces.a << ", "
            << found.faces.b << "; ";
    const MovingBodies moving = hall.moving();
    std::vector<double> moments;
    if (!found.hit && found.complete) moments.push_back(1);
    for (int i = 1; i < 40; ++i) moments.push_back(found.t * i / 40);
    for (int k = 6; k < 45; ++k) moments.push_back(found.t * (1 - std::ldexp(1, -k)));
    const auto deeperThan = [&](double overlap, std::size_t facesOfA) {
        for (const double t : moments) {
            if (t >= found.t && (found.hit || !found.complete)) continue;
            for (const FacePair& pair : moving.pierced(t, hall.up, overlap)) {
                if (pair.a >= facesOfA || std::ranges::binary_search(hall.within, pair)) continue;
                out << "faces " << pair.a << ", " << pair.b << " pierce each other at " << t << ", a hit: " << found.hit
                    << " at " << found.t << "; ";
                return;
            }
        }
    };
    // Who comes from aside may overlap by as much as a support allows; who slides on the floor, none of it.
    deeperThan(hall.sunk + kOverlap + 2 * kRounding, hall.all().indices.size() / 3);
    if (goes == Goes::kAlong || goes == Goes::kTurningAlong) deeperThan(2 * kRounding, hall.floor.indices.size() / 3);
    if (found.hit && found.support < 0) {
        const auto only = [](const Body& body, std::uint32_t face) {
            Body one = body;
            one.indices.assign(body.indices.begin() + 3 * face, body.indices.begin() + 3 * face + 3);
            return one.mesh();
        };
        const MovingBodies named(only(hall.all(), found.faces.a), hall.motionA, only(hall.mover, found.faces.b),
                                 hall.motionB);
        if (named.apart(found.t, 1.001 * kTolerance)) out << "the faces named are not near; ";
    }
    return out.str();
}

class RestingBodies : public testing::TestWithParam<Goes> {};

TEST_P(RestingBodies, AreHeldAndPassNothing) {
    std::uint64_t from = 1, count = GetParam() == Goes::kCarried ? 10 : 50;
    if (const char* hunt = std::getenv("TESSERA_HUNT")) count *= std::strtoull(hunt, nullptr, 10);
    if (const char* seed = std::getenv("TESSERA_SEED")) from = std::strtoull(seed, nullptr, 10), count = 1;
    std::uint64_t hits = 0, free = 0;
    for (std::uint64_t seed = from; seed < from + count; ++seed) {
        const Hall hall = hallOf(GetParam(), seed);
        const Impact found = hall.answer();
        EXPECT_EQ(wrong(GetParam(), hall, found), "") << "TESSERA_SEED=" << seed;
        hits += found.hit;
        free += mustGo(GetParam(), hall);
    }
    std::printf("%llu trials: %llu stopped, %llu certainly with nothing to be stopped by\n",
                static_cast<unsigned long long>(count), static_cast<unsigned long long>(hits),
                static_cast<unsigned long long>(free));
}

INSTANTIATE_TEST_SUITE_P(Ways, RestingBodies,
                         testing::Values(Goes::kAlong, Goes::kTurningAlong, Goes::kAway, Goes::kTrapdoor,
                                         Goes::kCarried, Goes::kPressed, Goes::kTilting, Goes::kOutOfTheFloor),
                         [](const testing::TestParamInfo<Goes>& of) {
                             return std::string(kNames[static_cast<std::size_t>(of.param)]);
                         });

/// An oracle that would say yes to anything is none.
TEST(RestingOracle, SaysNoToAnswersThatAreWrong) {
    int late = 0, stopped = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        const Hall hall = hallOf(Goes::kAlong, seed);
        const Impact right = hall.answer();
        Impact other = right;
        if (right.hit && right.t > 0) {
            other.t = std::min(1.0, right.t + 0.02);
            late += !wrong(Goes::kAlong, hall, other).empty();
        } else if (!right.hit) {
            other.hit = true;
            other.t = 0;
            stopped += !wrong(Goes::kAlong, hall, other).empty();
        }
    }
    EXPECT_GT(late, 2);
    EXPECT_GT(stopped, 5);
}

}  // namespace
}  // namespace tessera
