// What do the ways of bounding a turned k-DOP give, and what do they cost?
//
// Tightness: how far the bound exceeds the true support along a random direction, divided by the radius about the mean:
// on random anisotropic clouds of 30 points (as in the design notes' table) and on clusters of real models where there
// are any. Cost: realigning 16 volumes at a time, all half-planes, and testing them against one volume, beside the same
// test of volumes that need no realignment (the floor). Compiled for the base instruction set; trees have wider
// kernels.
//
//     bench_realignment [--held-back] [--quick] [--json FILE]
//
// --held-back: other models and another seed than those by which the default was chosen. --quick: a few of each, to see
// that all works.
#include <fmt/format.h>

#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "server/collision/volume/Realignment.h"
#include "server/collision/volume/SupportProfile.h"
#include "tests/unit/volume/Clusters.h"
#include "tests/unit/volume/Realigned.h"

namespace tessera {
namespace {

using namespace clouds;

enum Scheme { kBox, kRings, kFourSectors, kEightSectors, kPlanes, kPolytope, kSchemes };
const char* const kSchemeNames[kSchemes] = {"axis box",     "table, 8 rings", "table, 8 x 4",
                                            "table, 8 x 8", "3 planes",       "exact DOP"};
constexpr std::uint8_t kSectors[kSchemes] = {0, 1, 4, 8, 0, 0};
const DirectionSet kCompared[] = {DirectionSet::k14, DirectionSet::k18, DirectionSet::k26};

std::string setName(DirectionSet set) {
    return std::to_string(2 * directionCount(set));
}

bool isTable(Scheme s) {
    return kSectors[s] > 0;
}
ProfileShape shapeOf(DirectionSet set, Scheme s) {
    return {set, kSectors[s], 8};
}
PlaneChoice choiceOf(Scheme s) {
    return s == kBox ? PlaneChoice::kBoxEnclosure : PlaneChoice::kThreePlanes;
}

// ---- tightness
// -------------------------------------------------------------------------------------------------------

struct Tightness {
    std::string data;
    DirectionSet set;
    double excess[kSchemes] = {};
    long violations = 0;
};

/// Mean over clouds and eight rotations of each.
Tightness tightness(std::string data, DirectionSet set, std::span<const Cloud> clouds, Random& random) {
    Tightness row{.data = std::move(data), .set = set};
    for (const Cloud& cloud : clouds) {
        const KDop dop = KDop::around(set, cloud);
        SupportProfile profiles[kSchemes];
        for (int s = 0; s < kSchemes; ++s)
            if (isTable(Scheme(s))) profiles[s] = SupportProfile::around(shapeOf(set, Scheme(s)), cloud);
        const double size = radius(cloud, mean(cloud));
        double extent = 0;  // the simplex method is right to rounding of this
        for (std::size_t k = 0; k < dop.count(); ++k) extent = std::max(extent, dop.magnitude(k));
        for (int i = 0; i < 8; ++i) {
            Affine3d m = Affine3d::Identity();
            m.linear() = turn(random).toRotationMatrix();
            const Vec3d p = m.linear().row(0);
            double truth = -std::numeric_limits<double>::infinity();
            for (const Vec3d& x : cloud) truth = std::max(truth, x.dot(p));
            for (int s = 0; s < kSchemes; ++s) {
                double bound = 0;
                if (s == kPolytope)
                    bound = polytopeSupport(dop, p) + 1e-13 * extent;
                else if (isTable(Scheme(s)))
                    bound =
                        realigned(ProfileLookup::make(profiles[s].shape, DirectionSet::k6, m), profiles[s]).upper[0];
                else
                    bound = realigned(PlaneWeights::make(set, DirectionSet::k6, m, choiceOf(Scheme(s))), dop).upper[0];
                row.violations += bound < truth;
                row.excess[s] += (bound - truth) / size / 8 / double(clouds.size());
            }
        }
    }
    return row;
}

/// Evenly in a box along the axes: what the design notes' table seems to be about.
Cloud boxCloud(Random& random) {
    const Vec3d size(uniform(random, 0.2, 1), uniform(random, 0.2, 1), uniform(random, 0.2, 1));
    Cloud cloud;
    for (int i = 0; i < 30; ++i) {
        const double x = uniform(random, -1, 1), y = uniform(random, -1, 1), z = uniform(random, -1, 1);
        cloud.emplace_back(size.cwiseProduct(Vec3d(x, y, z)));
    }
    return cloud;
}

struct Options {
    bool heldBack = false, quick = false;
    std::string json;
};

std::vector<Tightness> allTightness(const Options& options) {
    std::vector<Tightness> rows;
    Random random(options.heldBack ? 1001 : 1);
    std::vector<Cloud> boxes, made;
    for (int i = 0; i < (options.quick ? 20 : 1000); ++i) {
        boxes.push_back(boxCloud(random));
        made.push_back(anisotropic(random, 30));
    }
    for (const DirectionSet set : kCompared) rows.push_back(tightness("random in boxes", set, boxes, random));
    for (const DirectionSet set : kCompared) rows.push_back(tightness("random, turned", set, made, random));
    using Model = std::pair<const char*, const char*>;
    const std::vector<Model> models = options.heldBack
                                          ? std::vector<Model>{{"koala", "meshes/koala/koala_low_resolution.obj"},
                                                               {"brass", "plant/Brass.obj"},
                                                               {"gasket", "plant/Gasket.obj"}}
                                          : std::vector<Model>{{"bunny", "scan/stanford_bun_zipper.ply"},
                                                               {"plant steel", "plant/Structural_steel.obj"}};
    for (const auto& [name, file] : models) {
        std::vector<Corners> triangles = readModel(dataFolder() / file);
        if (triangles.empty()) std::printf("%s: no such test data, left out (see TESSERA_TEST_DATA)\n", file);
        for (const std::size_t most : {4, 64, 1024}) {
            std::vector<Cloud> clusters;
            divide(triangles, most, clusters);
            std::shuffle(clusters.begin(), clusters.end(), random);
            clusters.resize(std::min<std::size_t>(clusters.size(), options.quick ? 10 : 200));
            std::erase_if(clusters, [](const Cloud& c) { return radius(c, mean(c)) == 0; });
            if (clusters.empty()) continue;
            for (const DirectionSet set : kCompared)
                rows.push_back(tightness(fmt::format("{}, {} faces", name, most), set, clusters, random));
        }
    }
    return rows;
}

// ---- cost
// ------------------------------------------------------------------------------------------------------------

constexpr std::size_t kLanes = 16, kBlocks = 256, kVolumes = kLanes * kBlocks;
constexpr int kRounds = 41, kQuickRounds = 3;

/// What the base instruction set tests at once: a quarter of a block.
using Quad [[gnu::vector_size(16)]] = float;
constexpr std::size_t kQuads = kLanes / 4;

struct Lanes {
    Quad quad[kQuads];
    void set(std::size_t lane, float value) { quad[lane / 4][lane % 4] = value; }
};
struct Block {
    Lanes h[2 * kMaxDirections];
};
struct ProfileBlock {
    Lanes center[3], step;
};

/// Structures of arrays, as nodes of trees are.
struct Volumes {
    DirectionSet set;
    std::vector<Block> planes{kBlocks};
    std::vector<ProfileBlock> heads{kBlocks};
    std::vector<std::uint8_t> tables;  ///< [block][entry][lane]
    KDop whole;
};

Volumes makeVolumes(DirectionSet set, std::uint8_t sectors) {
    Volumes v{.set = set, .tables = {}, .whole = KDop(set)};
    const ProfileShape shape{set, sectors, 8};
    if (sectors > 0) v.tables.resize(shape.size() * kVolumes);
    Random random(7);
    for (std::size_t i = 0; i < kVolumes; ++i) {
        Cloud cloud = anisotropic(random, 12);
        const Vec3d away = 20 * normal(random);
        for (Vec3d& x : cloud) x += away;
        const KDop dop = KDop::around(set, cloud);
        v.whole.extend(dop);
        const std::size_t block = i / kLanes, lane = i % kLanes;
        for (std::size_t k = 0; k < 2 * dop.count(); ++k)
            v.planes[block].h[k].set(lane, std::nextafterf(float(dop.halfPlane(k)), INFINITY));
        if (sectors == 0) continue;
        const SupportProfile profile = SupportProfile::around(shape, cloud);
        for (int j = 0; j < 3; ++j) v.heads[block].center[j].set(lane, profile.center[j]);
        v.heads[block].step.set(lane, profile.step);
        for (std::size_t e = 0; e < shape.size(); ++e)
            v.tables[(block * shape.size() + e) * kLanes + lane] = profile.table[e];
    }
    return v;
}

/// Per half-plane: the least that a volume must reach to touch the target.
using Target = std::array<float, 2 * kMaxDirections>;

// Always inlined: passing vectors by value differs with and without AVX.
[[gnu::always_inline]] inline Quad least(Quad a, Quad b) {
    return a < b ? a : b;
}
/// Lanes whose volumes no half-plane parts from the target.
[[gnu::always_inline]] inline std::uint32_t overlapping(Quad gap) {
    std::uint32_t count = 0;
    for (int lane = 0; lane < 4; ++lane) count += gap[lane] >= 0;
    return count;
}
constexpr Quad kFar = {INFINITY, INFINITY, INFINITY, INFINITY};

[[gnu::noinline]] std::uint32_t testAligned(const Volumes& v, const Target& most) {
    std::uint32_t count = 0;
    const std::size_t planes = 2 * directionCount(v.set);
    for (const Block& block : v.planes)
        for (std::size_t q = 0; q < kQuads; ++q) {
            Quad gap = kFar;
            for (std::size_t i = 0; i < planes; ++i) gap = least(block.h[i].quad[q] - most[i], gap);
            count += overlapping(gap);
        }
    return count;
}

[[gnu::noinline]] std::uint32_t testPlanes(const Volumes& v, const FloatPlaneWeights& w, const Target& most) {
    std::uint32_t count = 0;
    const std::size_t planes = 2 * directionCount(v.set);
    for (const Block& block : v.planes)
        for (std::size_t q = 0; q < kQuads; ++q) {
            Quad gap = kFar;
            for (std::size_t i = 0; i < planes; ++i) {
                const Quad a = block.h[w.plane[i][0]].quad[q], b = block.h[w.plane[i][1]].quad[q],
                           c = block.h[w.plane[i][2]].quad[q];
                const float* weight = w.weight[i];
                gap = least(weight[0] * a + weight[1] * b + weight[2] * c + (w.offset[i] - most[i]), gap);
            }
            count += overlapping(gap);
        }
    return count;
}

[[gnu::noinline]] std::uint32_t testTable(const Volumes& v, const FloatProfileLookup& w, const Target& most) {
    std::uint32_t count = 0;
    const std::size_t half = directionCount(v.set), entries = v.tables.size() / kVolumes;
    const auto entry = [](const std::uint8_t* at) {
        return Quad{float(at[0]), float(at[1]), float(at[2]), float(at[3])};
    };
    for (std::size_t n = 0; n < kBlocks; ++n)
        for (std::size_t q = 0; q < kQuads; ++q) {
            const ProfileBlock& head = v.heads[n];
            const std::uint8_t* table = v.tables.data() + n * entries * kLanes + 4 * q;
            const Quad x = head.center[0].quad[q], y = head.center[1].quad[q], z = head.center[2].quad[q];
            Quad gap = kFar;
            for (std::size_t i = 0; i < half; ++i) {
                const float* p = w.vector[i];
                const Quad middle = p[0] * x + p[1] * y + p[2] * z, unit = w.length[i] * head.step.quad[q];
                const Quad above = unit * entry(table + w.entry[i] * kLanes);
                const Quad below = unit * entry(table + w.entry[i + half] * kLanes);
                gap = least(above + middle + (w.offset[i] - most[i]), gap);
                gap = least(below - middle + (w.offset[i + half] - most[i + half]), gap);
            }
            count += overlapping(gap);
        }
    return count;
}

double nanoseconds(const std::function<void()>& work) {
    const auto now = [] {
        timespec time{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
        return double(time.tv_sec) * 1e9 + double(time.tv_nsec);
    };
    const double start = now();
    work();
    return now() - start;
}

double median(std::vector<double> times) {
    std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
    return times[times.size() / 2];
}

struct Cost {
    DirectionSet set;
    Scheme scheme;
    double nsPerVolume = 0, floor = 0;  ///< realigned and tested; tested only
    double nsPerQuery = 0;              ///< the set-up for a pair of frames
    double nsPerPoint = 0;              ///< to build, with 12 points a volume
    std::size_t bytes = 0;              ///< per volume
};

Cost cost(DirectionSet set, Scheme scheme, int rounds) {
    Cost c{.set = set, .scheme = scheme};
    const std::uint8_t sectors = kSectors[scheme];
    const Volumes v = makeVolumes(set, sectors);
    Random random(8);
    Affine3d m = Affine3d::Identity();
    m.linear() = turn(random).toRotationMatrix();
    const Cloud at = anisotropic(random, 30);
    Cloud large = at;
    for (Vec3d& x : large) x *= 10;
    const KDop target = KDop::around(set, large);
    Target most{};
    for (std::size_t i = 0; i < 2 * target.count(); ++i)
        most[i] = float(-target.halfPlane(i < target.count() ? i + target.count() : i - target.count()));

    const PlaneWeights planes = PlaneWeights::make(set, set, m, choiceOf(scheme));
    const FloatPlaneWeights planeKernel = forKernels(planes, v.whole);
    const ProfileShape shape{set, std::max<std::uint8_t>(1, sectors), 8};
    const FloatProfileLookup tableKernel = forKernels(ProfileLookup::make(shape, set, m), v.whole);
    std::vector<double> ours, floor, queries, points;
    std::uint32_t sink = 0;
    constexpr int kQueries = 200;
    for (int round = 0; round < rounds; ++round) {
        ours.push_back(nanoseconds([&] {
                           sink += isTable(scheme) ? testTable(v, tableKernel, most) : testPlanes(v, planeKernel, most);
                       }) /
                       kVolumes);
        sink += testAligned(v, most);  // tables may have driven the planes out of the caches
        floor.push_back(nanoseconds([&] { sink += testAligned(v, most); }) / kVolumes);
        queries.push_back(
            nanoseconds([&] {
                for (int i = 0; i < kQueries; ++i) {
                    m.translation().x() = i;
                    if (isTable(scheme))
                        sink += forKernels(ProfileLookup::make(shape, set, m), v.whole).entry[i % 5];
                    else
                        sink += forKernels(PlaneWeights::make(set, set, m, choiceOf(scheme)), v.whole).plane[i % 5][0];
                }
            }) /
            kQueries);
        points.push_back(nanoseconds([&] {
                             for (int i = 0; i < 10; ++i) {
                                 if (isTable(scheme))
                                     sink += SupportProfile::around(shape, at).table[7];
                                 else
                                     sink += KDop::around(set, at).upper[1] > 0;
                             }
                         }) /
                         10 / double(at.size()));
    }
    c.nsPerVolume = median(ours);
    c.floor = median(floor);
    c.nsPerQuery = median(queries);
    c.nsPerPoint = median(points);
    c.bytes = isTable(scheme) ? shape.size() + 16 : scheme == kBox ? 24 : 8 * directionCount(set);
    if (sink == 0) std::puts("");
    return c;
}

// ---- output
// ----------------------------------------------------------------------------------------------------------

std::string json(const std::vector<Tightness>& rows, const std::vector<Cost>& costs) {
    std::string entries;
    const auto add = [&](std::string name, std::string_view peer, double ours, double theirs, std::string_view unit) {
        entries += fmt::format(
            "{}\n  {{\"case\": \"{}\", \"peer\": \"{}\", \"ours\": {:.17g}, \"theirs\": {:.17g}, "
            "\"unit\": \"{}\", \"ratio\": {:.17g}}}",
            entries.empty() ? "" : ",", name, peer, ours, theirs, unit, ours / theirs);
    };
    for (const Tightness& r : rows)
        for (int s = 0; s < kSchemes; ++s)
            add(fmt::format("excess, {}, {} directions, {}", r.data, setName(r.set), kSchemeNames[s]), "axis box",
                r.excess[s], r.excess[kBox], "radii");
    for (const Cost& c : costs) {
        const std::string name = fmt::format("{} directions, {}", setName(c.set), kSchemeNames[c.scheme]);
        add("realign and test, " + name, "the test alone", c.nsPerVolume, c.floor, "ns per volume");
        add("memory, " + name, "the k-DOP", double(c.bytes), 8.0 * double(directionCount(c.set)), "bytes per volume");
    }
    return "{\"cases\": [" + entries + "\n]}\n";
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    using namespace tessera;
    Options options;
    const std::vector<std::string> words(argv + 1, argv + argc);
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (words[i] == "--held-back")
            options.heldBack = true;
        else if (words[i] == "--quick")
            options.quick = true;
        else if (words[i] == "--json" && i + 1 < words.size())
            options.json = words[++i];
        else {
            std::fprintf(stderr, "usage: bench_realignment [--held-back] [--quick] [--json FILE]\n");
            return 2;
        }
    }
    const std::vector<Tightness> rows = allTightness(options);
    std::printf("mean excess over the true support / radius\n%-26s %4s", "", "k");
    for (const char* name : kSchemeNames) std::printf(" %15s", name);
    std::printf("\n");
    long violations = 0;
    for (const Tightness& r : rows) {
        std::printf("%-26s %4s", r.data.c_str(), setName(r.set).c_str());
        for (const double e : r.excess) std::printf(" %15.3f", e);
        std::printf("\n");
        violations += r.violations;
    }
    std::printf("bounds below the truth: %ld\n\n", violations);

    std::vector<Cost> costs;
    std::printf("%4s %-15s %10s %14s %8s %10s %10s %12s\n", "k", "", "ns/volume", "the test alone", "ratio", "ns/query",
                "ns/point", "bytes/volume");
    for (const DirectionSet set : kCompared)
        for (int s = 0; s < kPolytope; ++s) {
            costs.push_back(cost(set, Scheme(s), options.quick ? kQuickRounds : kRounds));
            const Cost& c = costs.back();
            std::printf("%4s %-15s %10.2f %14.2f %8.2f %10.0f %10.1f %12zu\n", setName(set).c_str(), kSchemeNames[s],
                        c.nsPerVolume, c.floor, c.nsPerVolume / c.floor, c.nsPerQuery, c.nsPerPoint, c.bytes);
        }
    if (options.json.empty()) return violations != 0;
    std::FILE* file = std::fopen(options.json.c_str(), "w");
    const std::string text = json(rows, costs);
    if (!file || std::fwrite(text.data(), 1, text.size(), file) != text.size() || std::fclose(file) != 0) {
        std::fprintf(stderr, "bench_realignment: %s cannot be written\n", options.json.c_str());
        return 1;
    }
    return violations != 0;
}
