/// One ray after another through a mesh of ten million triangles, beside Embree's rtcIntersect1, as Debian ships it.
///
/// The mesh is a ball with dents of three sizes, closed but for its poles, made of quads in two triangles each. Rays:
/// random ones from around it towards somewhere in it; random ones from within; those of a camera before it, row by
/// row. One thread. Contenders take turns, pass by pass, on the same rays; a row shows the median over the passes of
/// the thread's processor time per ray, and of the ratios of each pass. Embree builds with its usual quality, once with
/// its usual triangles and once with RTC_SCENE_FLAG_ROBUST, which is what ours are like: no ray passes between two
/// triangles. Answers are compared: where t differ by more than 1e-4, or one meets nothing, all triangles are asked in
/// long double who is right.
#include <embree3/rtcore.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "common/rays/RayTree.h"

namespace tessera {
namespace {

double processorSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
double median(std::vector<double> values) {
    std::ranges::sort(values);
    return values[values.size() / 2];
}

struct DentedBall {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;

    explicit DentedBall(std::size_t faces) {
        const auto side = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(faces) / 2));
        for (std::uint32_t j = 0; j <= side; ++j)
            for (std::uint32_t i = 0; i <= side; ++i) {
                const double u = 2 * std::numbers::pi * i / side, v = std::numbers::pi * j / side;
                const double r = 1 + 0.05 * std::sin(40 * u) * std::sin(31 * v) + 0.01 * std::sin(311 * u + 5 * v) +
                                 0.002 * std::sin(997 * v);
                for (const double p : {r * std::sin(v) * std::cos(u), r * std::cos(v), r * std::sin(v) * std::sin(u)})
                    positions.push_back(static_cast<float>(p));
            }
        for (std::uint32_t j = 0; j < side; ++j)
            for (std::uint32_t i = 0; i < side; ++i) {
                const std::uint32_t a = j * (side + 1) + i, b = a + 1, c = a + side + 1, d = c + 1;
                indices.insert(indices.end(), {a, b, c, b, d, c});
            }
    }
    [[nodiscard]] std::size_t faces() const { return indices.size() / 3; }
};

/// All numbers are floats, so that both trace the same rays.
std::vector<Ray> raysOf(const std::string& kind, std::size_t count) {
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    const auto onSphere = [&] { return Vec3d(normal(random), normal(random), normal(random)).normalized(); };
    const auto width = static_cast<std::size_t>(std::sqrt(static_cast<double>(count) * 1.25));
    std::vector<Ray> rays(count);
    for (std::size_t i = 0; i < count; ++i) {
        Ray& ray = rays[i];
        if (kind == "random, from around") {
            ray.origin = 3 * onSphere();
            ray.direction = 0.9 * onSphere() - ray.origin;
        } else if (kind == "random, from within") {
            ray = {0.5 * onSphere(), onSphere()};
        } else {
            const double x = static_cast<double>(i % width) / static_cast<double>(width) - 0.5;
            const double y =
                static_cast<double>(i / width) / (static_cast<double>(count) / static_cast<double>(width)) - 0.5;
            ray = {Vec3d(0.3, 0.2, 3), Vec3d(0.9 * x, 0.72 * y, -1).normalized()};
        }
        ray.origin = ray.origin.cast<float>().cast<double>();
        ray.direction = ray.direction.cast<float>().cast<double>();
    }
    return rays;
}

class EmbreeScene {
public:
    EmbreeScene(DentedBall& ball, RTCSceneFlags flags) {
        rtcSetSceneFlags(scene_, flags);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        ball.positions.resize(ball.positions.size() + 4);  // it reads 16 bytes of each vertex
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, ball.positions.data(), 0, 12,
                                   ball.positions.size() / 3);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, ball.indices.data(), 0, 12,
                                   ball.faces());
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    ~EmbreeScene() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    /// Infinite: nothing.
    [[nodiscard]] float nearest(const Ray& ray) {
        RTCRayHit query{};
        query.ray.org_x = static_cast<float>(ray.origin.x());
        query.ray.org_y = static_cast<float>(ray.origin.y());
        query.ray.org_z = static_cast<float>(ray.origin.z());
        query.ray.dir_x = static_cast<float>(ray.direction.x());
        query.ray.dir_y = static_cast<float>(ray.direction.y());
        query.ray.dir_z = static_cast<float>(ray.direction.z());
        query.ray.tfar = std::numeric_limits<float>::infinity();
        query.ray.mask = ~0u;
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect1(scene_, &context, &query);
        return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<float>::infinity() : query.ray.tfar;
    }

private:
    RTCDevice device_ = rtcNewDevice("threads=1");
    RTCScene scene_ = rtcNewScene(device_);
};

/// The nearest of all triangles (T. Möller, B. Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997).
/// Infinite: nothing.
long double nearestOfAll(const DentedBall& ball, const Ray& ray) {
    using Vec = Eigen::Matrix<long double, 3, 1>;
    const Vec origin = ray.origin.cast<long double>(), direction = ray.direction.cast<long double>();
    long double best = std::numeric_limits<long double>::infinity();
    for (std::size_t face = 0; face < ball.faces(); ++face) {
        Vec corner[3];
        for (std::size_t i = 0; i < 3; ++i) {
            const float* p = &ball.positions[std::size_t{3} * ball.indices[3 * face + i]];
            corner[i] = Vec(p[0], p[1], p[2]);
        }
        const Vec a = corner[1] - corner[0], b = corner[2] - corner[0], p = direction.cross(b), s = origin - corner[0],
                  q = s.cross(a);
        const long double det = a.dot(p);
        if (det == 0) continue;
        const long double u = s.dot(p) / det, v = direction.dot(q) / det, t = b.dot(q) / det;
        if (u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t < best) best = t;
    }
    return best;
}

struct Row {
    std::string name, peer;
    double ours, theirs, ratio;
};

int bench(int argc, char** argv) {
    std::size_t faces = 10'000'000, count = 200'000;
    int passes = 7;
    std::string json;
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        const auto value = [&] { return i + 1 < argc ? argv[++i] : ""; };
        if (option == "--json")
            json = value();
        else if (option == "--faces")
            faces = std::strtoull(value(), nullptr, 10);
        else if (option == "--rays")
            count = std::strtoull(value(), nullptr, 10);
        else if (option == "--passes")
            passes = std::max(1, std::atoi(value()));
        else if (option == "--quick")
            faces = 100'000, count = 20'000, passes = 1;
        else {
            std::fprintf(stderr, "bench_ray: unknown option %s; --faces N, --rays N, --passes N, --quick\n", argv[i]);
            return 2;
        }
    }
    faces = std::clamp<std::size_t>(faces, 8, 50'000'000);
    count = std::clamp<std::size_t>(count, 100, 10'000'000);
    DentedBall ball(faces);
    double begin = processorSeconds();
    const Expected<RayTree> tree = RayTree::build(ball.positions, ball.indices);
    std::printf("%zu faces; our tree %.1f s, %.0f bytes a face\n", ball.faces(), processorSeconds() - begin,
                static_cast<double>(tree->memoryBytes()) / static_cast<double>(ball.faces()));
    std::vector<Row> rows;
    std::printf("%-22s %-18s %9s %9s %7s   %s\n", "ns per ray", "beside", "ours", "theirs", "ratio",
                "answers that differ; who is right");
    for (const bool robust : {false, true}) {
        EmbreeScene embree(ball, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
        for (const char* const kind : {"random, from around", "random, from within", "camera"}) {
            const std::vector<Ray> rays = raysOf(kind, count);
            std::vector<float> ours(count), theirs(count);
            std::vector<double> ourTimes, theirTimes, ratios;
            for (int pass = 0; pass < passes; ++pass) {
                begin = processorSeconds();
                for (std::size_t i = 0; i < count; ++i) {
                    const std::optional<TriangleHit> hit = tree->nearest(rays[i]);
                    ours[i] = hit ? static_cast<float>(hit->t) : std::numeric_limits<float>::infinity();
                }
                const double middle = processorSeconds();
                for (std::size_t i = 0; i < count; ++i) theirs[i] = embree.nearest(rays[i]);
                const double end = processorSeconds();
                ourTimes.push_back((middle - begin) * 1e9 / static_cast<double>(count));
                theirTimes.push_back((end - middle) * 1e9 / static_cast<double>(count));
                ratios.push_back((middle - begin) / (end - middle));
            }
            const auto differ = [](double a, double b) {
                return std::isinf(a) != std::isinf(b) || (!std::isinf(a) && std::abs(a - b) > 1e-4 * b);
            };
            std::size_t many = 0, asked = 0, oursRight = 0, theirsRight = 0;
            for (std::size_t i = 0; i < count; ++i) {
                if (!differ(ours[i], theirs[i]) || ++many > 8) continue;
                const auto truth = static_cast<double>(nearestOfAll(ball, rays[i]));
                ++asked;
                oursRight += !differ(ours[i], truth);
                theirsRight += !differ(theirs[i], truth);
            }
            rows.push_back(
                {kind, robust ? "Embree, robust" : "Embree", median(ourTimes), median(theirTimes), median(ratios)});
            const Row& row = rows.back();
            std::printf("%-22s %-18s %9.0f %9.0f %7.2f   %zu; of %zu ours %zu, theirs %zu\n", row.name.c_str(),
                        row.peer.c_str(), row.ours, row.theirs, row.ratio, many, asked, oursRight, theirsRight);
            std::fflush(stdout);
        }
    }
    if (json.empty()) return 0;
    std::ofstream out(json);
    out << "{\"cases\":[";
    for (std::size_t i = 0; i < rows.size(); ++i)
        out << (i ? "," : "") << "{\"case\":\"" << rows[i].name << "\",\"peer\":\"" << rows[i].peer
            << "\",\"ours\":" << rows[i].ours << ",\"theirs\":" << rows[i].theirs
            << ",\"unit\":\"ns\",\"ratio\":" << rows[i].ratio << "}";
    out << "]}\n";
    return out ? 0 : 1;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::bench(argc, argv);
}
