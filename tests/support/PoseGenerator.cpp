#include "tests/support/PoseGenerator.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "common/base/Error.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TouchQuery.h"

namespace tessera {

namespace {

/// The same numbers from a seed with every standard library.
class Source {
public:
    explicit Source(std::uint64_t seed) : engine_(seed) {}
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    Vec3d direction() {
        const double z = 2 * uniform() - 1;
        const double angle = 2 * std::numbers::pi * uniform();
        const double r = std::sqrt(1 - z * z);
        return {r * std::cos(angle), r * std::sin(angle), z};
    }
    /// Uniform over all rotations (Shoemake 1992).
    Quatd rotation() {
        const double u = uniform(), a = 2 * std::numbers::pi * uniform(), b = 2 * std::numbers::pi * uniform();
        return Quatd(std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
                     std::sqrt(u) * std::sin(b))
            .normalized();
    }

private:
    std::mt19937_64 engine_;
};

/// Conservative advancement along d. Nothing where B passes A by.
std::optional<double> contactDistance(const PoseOracle& oracle, const Quatd& rotation, const Vec3d& d) {
    // No body of diagonal 1 about its box's centre reaches farther than 0.5 from it.
    double s = 1.01;
    for (int step = 0; step < 200 && s > 0; ++step) {
        const Pose pose{.translation = s * d, .rotation = rotation};
        const double free = oracle.distance(pose.matrix());
        if (free < 1e-7) return s;
        s -= free;
    }
    return std::nullopt;
}

}  // namespace

std::string_view name(Closeness closeness) {
    switch (closeness) {
        case Closeness::kSeparated:
            return "separated";
        case Closeness::kNear:
            return "near";
        case Closeness::kShallow:
            return "shallow";
        case Closeness::kDeep:
            return "deep";
    }
    return "";
}

PoseOracle ownOracle(const TriangleTree& a, const TriangleTree& b) {
    return {[&](const Affine3d& a_T_b) {
                QueryWork work;
                return firstTouching(a, b, a_T_b, work).touch == Touch::kYes;
            },
            [&](const Affine3d& a_T_b) {
                QueryWork work;
                return distanceBetween(a, b, a_T_b, work).distance;
            }};
}

std::vector<TestPose> makePoses(const PoseOracle& oracle, std::size_t count, std::uint64_t seed) {
    std::vector<TestPose> poses;
    Source random(seed);
    for (std::size_t tries = 0; poses.size() < count; ++tries) {
        TESSERA_CHECK(tries < 100 * count + 100, "bodies that cannot be brought to touch");
        const auto closeness = static_cast<Closeness>(poses.size() % 4);
        const Quatd rotation = random.rotation();
        const Vec3d d = random.direction();
        const std::optional<double> contact = contactDistance(oracle, rotation, d);
        const double u = random.uniform();
        if (!contact) continue;
        double s = 0;
        switch (closeness) {
            case Closeness::kSeparated:
                s = *contact + 0.02 + 0.38 * u;
                break;
            case Closeness::kNear:
                s = *contact + std::pow(10, -4 + 2 * u);
                break;
            case Closeness::kShallow:
                s = *contact - std::pow(10, -4 + 2 * u);
                break;
            case Closeness::kDeep:
                s = *contact * (0.3 + 0.5 * u);
                break;
        }
        const Pose pose{.translation = s * d, .rotation = rotation};
        const bool shouldTouch = closeness == Closeness::kShallow || closeness == Closeness::kDeep;
        if (oracle.touching(pose.matrix()) == shouldTouch) poses.push_back({closeness, pose});
    }
    return poses;
}

std::vector<BodyMotion> makeMotions(const PoseOracle& oracle, std::size_t count, std::uint64_t seed) {
    std::vector<BodyMotion> motions;
    Source random(seed);
    for (std::size_t tries = 0; motions.size() < count; ++tries) {
        TESSERA_CHECK(tries < 100 * count + 100, "bodies that cannot be brought to touch");
        const Quatd rotation = random.rotation();
        const Vec3d d = random.direction();
        const std::optional<double> contact = contactDistance(oracle, rotation, d);
        const double u = random.uniform();
        const Vec3d e = random.direction();
        const Eigen::AngleAxisd turn(random.uniform() * std::numbers::pi / 3, random.direction());
        if (!contact) continue;
        motions.push_back({.start = {.translation = (*contact + 0.1 + 0.2 * u) * d, .rotation = rotation},
                           .end = {.translation = -0.4 * d + 0.5 * e, .rotation = Quatd(turn) * rotation}});
    }
    return motions;
}

}  // namespace tessera
