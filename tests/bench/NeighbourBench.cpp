/// Neighbour finding beside Embree's rtcCollide and Bullet's broad phases, as Debian ships them.
///
/// N boxes, half extents 0.5 · U(0.5, 1.5), in a cube of side 2 (N / 4)^(1/3), each with a speed of 0.05 per frame in a
/// direction of its own, reflected at the walls; all of them move, or every tenth, or all of them leap: each frame has
/// them at new places, so that nothing known of the last one helps. A frame is: tell the new boxes, ask for the pairs.
/// The frames are run through forth and back, the contenders taking turns pass by pass; a row shows the mean over the
/// frames of the fastest pass. One thread each, except where said. After every first pass the answers are compared:
/// what a peer reports beyond (Embree's leaves, Bullet's coarser boxes) is dropped, the rest must be our pairs.
#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "common/base/Workers.h"
#include "server/collision/neighbours/NeighbourFinder.h"
#include "tests/bench/CollisionTimer.h"
#include "tests/bench/OlderProcessor.h"

namespace tessera {
namespace {

using Pairs = std::vector<NeighbourPair>;

/// The boxes of each frame; which of them move.
struct Motion {
    std::vector<std::vector<Box>> frames;
    std::vector<std::uint32_t> movers;  ///< empty: all
    [[nodiscard]] std::size_t size() const { return frames.front().size(); }
    [[nodiscard]] bool everybody() const { return movers.empty(); }
};

/// All bounds are floats, so that single and double precision mean the same boxes.
Motion makeMotion(std::size_t n, std::size_t frameCount, std::size_t everyNth, unsigned seed, bool leap = false) {
    std::mt19937_64 random(seed);
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const double side = 2 * std::cbrt(static_cast<double>(n) / 4);
    struct Body {
        Vec3d at, speed, half;
    };
    std::vector<Body> bodies(n);
    for (Body& body : bodies) {
        for (int a = 0; a < 3; ++a) {
            body.at[a] = uniform(0, side);
            body.half[a] = 0.5 * uniform(0.5, 1.5);
            body.speed[a] = std::normal_distribution<double>()(random);
        }
        body.speed *= 0.05 / body.speed.norm();
    }
    Motion motion;
    if (everyNth > 1)
        for (std::size_t i = 0; i < n; i += everyNth) motion.movers.push_back(static_cast<std::uint32_t>(i));
    for (std::size_t f = 0; f < frameCount; ++f) {
        std::vector<Box>& boxes = motion.frames.emplace_back();
        for (std::size_t i = 0; i < n; ++i) {
            Body& body = bodies[i];
            Box box;
            box.lower = (body.at - body.half).cast<float>().cast<double>();
            box.upper = (body.at + body.half).cast<float>().cast<double>();
            boxes.push_back(box);
            if (i % everyNth != 0) continue;
            for (int a = 0; a < 3; ++a) {
                if (leap) body.at[a] = uniform(0, side);
                if (leap) continue;
                body.at[a] += body.speed[a];
                if (body.at[a] < 0 || body.at[a] > side) body.speed[a] = -body.speed[a];
            }
        }
    }
    return motion;
}

/// Somebody who is told boxes and asked for pairs.
class Contender {
public:
    Contender() = default;
    virtual ~Contender() = default;
    Contender(const Contender&) = delete;
    Contender& operator=(const Contender&) = delete;
    virtual void start(const Motion& motion) = 0;
    virtual void frame(const Motion& motion, std::size_t f) = 0;
    /// Not timed.
    [[nodiscard]] virtual Pairs found(const std::vector<Box>& boxes) = 0;

    std::string name;
    bool threads = false;
};

/// Of what a peer reports, the pairs that meet, in our order.
Pairs exact(Pairs pairs, const std::vector<Box>& boxes) {
    for (NeighbourPair& p : pairs)
        if (p.a > p.b) std::swap(p.a, p.b);
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    std::erase_if(pairs, [&](const NeighbourPair& p) { return !boxes[p.a].overlaps(boxes[p.b]); });
    return pairs;
}

class Ours final : public Contender {
public:
    Ours(const std::string& title, NeighbourMethod method, unsigned threadCount) : workers_(threadCount) {
        name = title;
        threads = threadCount > 1;
        finder_ = makeNeighbourFinder({.method = method, .workers = threadCount > 1 ? &workers_ : nullptr});
    }
    void start(const Motion& motion) override {
        finder_->reset(motion.frames[0], InteractionTable::everybody(motion.size()));
        found_ = finder_->pairs();
    }
    void frame(const Motion& motion, std::size_t f) override {
        const std::vector<Box>& boxes = motion.frames[f];
        if (motion.everybody()) {
            finder_->move(everyItem(boxes.size()), boxes);
        } else {
            for (const std::uint32_t item : motion.movers) finder_->move(item, boxes[item]);
        }
        found_ = finder_->pairs();
    }
    Pairs found(const std::vector<Box>&) override { return {found_.begin(), found_.end()}; }

private:
    [[nodiscard]] std::span<const std::uint32_t> everyItem(std::size_t count) {
        while (items_.size() < count) items_.push_back(static_cast<std::uint32_t>(items_.size()));
        return {items_.data(), count};
    }

    std::vector<std::uint32_t> items_;
    Workers workers_;
    std::unique_ptr<NeighbourFinder> finder_;
    std::span<const NeighbourPair> found_;
};

/// The scene of Embree: one geometry of N boxes, built anew or refitted each frame.
class Embree final : public Contender {
public:
    Embree(const std::string& title, RTCBuildQuality quality) : quality_(quality) {
        name = title;
        device_ = rtcNewDevice("threads=1,set_affinity=0");
    }
    ~Embree() override {
        if (scene_) rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    void start(const Motion& motion) override {
        boxes_ = &motion.frames[0];
        if (scene_) rtcReleaseScene(scene_);
        scene_ = rtcNewScene(device_);
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
        rtcSetSceneBuildQuality(scene_, quality_ == RTC_BUILD_QUALITY_MEDIUM ? quality_ : RTC_BUILD_QUALITY_LOW);
        geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryBuildQuality(geometry_, quality_);
        rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(motion.size()));
        rtcSetGeometryUserData(geometry_, this);
        rtcSetGeometryBoundsFunction(geometry_, &bounds, nullptr);
        rtcCommitGeometry(geometry_);
        rtcAttachGeometry(scene_, geometry_);
        rtcReleaseGeometry(geometry_);
        rtcCommitScene(scene_);
    }
    void frame(const Motion& motion, std::size_t f) override {
        boxes_ = &motion.frames[f];
        rtcCommitGeometry(geometry_);
        rtcCommitScene(scene_);
        pairs_.clear();
        rtcCollide(scene_, scene_, &collide, this);
    }
    Pairs found(const std::vector<Box>& boxes) override { return exact(pairs_, boxes); }

private:
    static void bounds(const RTCBoundsFunctionArguments* args) {
        const Box& box = (*static_cast<const Embree*>(args->geometryUserPtr)->boxes_)[args->primID];
        RTCBounds& out = *args->bounds_o;
        out.lower_x = static_cast<float>(box.lower.x());
        out.lower_y = static_cast<float>(box.lower.y());
        out.lower_z = static_cast<float>(box.lower.z());
        out.upper_x = static_cast<float>(box.upper.x());
        out.upper_y = static_cast<float>(box.upper.y());
        out.upper_z = static_cast<float>(box.upper.z());
    }
    /// Gets the contents of leaves that meet, which need not meet themselves; both orders of a pair.
    static void collide(void* user, RTCCollision* collisions, unsigned count) {
        Embree& self = *static_cast<Embree*>(user);
        for (unsigned i = 0; i < count; ++i) {
            const unsigned a = collisions[i].primID0, b = collisions[i].primID1;
            if (a < b && (*self.boxes_)[a].overlaps((*self.boxes_)[b])) self.pairs_.push_back({a, b});
        }
    }

    RTCBuildQuality quality_;
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
    RTCGeometry geometry_ = nullptr;
    const std::vector<Box>* boxes_ = nullptr;
    Pairs pairs_;
};

btVector3 vector(const Vec3d& v) {
    return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

class Bullet final : public Contender {
public:
    Bullet(const std::string& title, bool sweep) : sweep_(sweep) { name = title; }
    void start(const Motion& motion) override {
        gDbvtMargin = 0;
        proxies_.clear();
        const btScalar side = static_cast<btScalar>(2 * std::cbrt(static_cast<double>(motion.size()) / 4) + 2);
        const btVector3 low(-2, -2, -2), high(side, side, side);
        const auto handles = static_cast<unsigned>(motion.size() + 2);
        if (!sweep_) {
            broadphase_ = std::make_unique<btDbvtBroadphase>();
        } else if (handles < 16384) {
            broadphase_ =
                std::make_unique<btAxisSweep3>(low, high, static_cast<unsigned short>(handles), nullptr, true);
        } else {
            broadphase_ = std::make_unique<bt32BitAxisSweep3>(low, high, handles, nullptr, true);
        }
        for (std::size_t i = 0; i < motion.size(); ++i) {
            const Box& box = motion.frames[0][i];
            proxies_.push_back(broadphase_->createProxy(vector(box.lower), vector(box.upper), 0,
                                                        reinterpret_cast<void*>(i), 1, 1, nullptr));
        }
        broadphase_->calculateOverlappingPairs(nullptr);
    }
    void frame(const Motion& motion, std::size_t f) override {
        const std::vector<Box>& boxes = motion.frames[f];
        const auto set = [&](std::size_t i) {
            broadphase_->setAabb(proxies_[i], vector(boxes[i].lower), vector(boxes[i].upper), nullptr);
        };
        if (motion.everybody()) {
            for (std::size_t i = 0; i < boxes.size(); ++i) set(i);
        } else {
            for (const std::uint32_t i : motion.movers) set(i);
        }
        broadphase_->calculateOverlappingPairs(nullptr);
    }
    Pairs found(const std::vector<Box>& boxes) override {
        btBroadphasePairArray& array = broadphase_->getOverlappingPairCache()->getOverlappingPairArray();
        Pairs pairs;
        for (int i = 0; i < array.size(); ++i) pairs.push_back({index(array[i].m_pProxy0), index(array[i].m_pProxy1)});
        return exact(std::move(pairs), boxes);
    }

private:
    static std::uint32_t index(const btBroadphaseProxy* proxy) {
        return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(proxy->m_clientObject));
    }

    bool sweep_;
    std::unique_ptr<btBroadphaseInterface> broadphase_;
    std::vector<btBroadphaseProxy*> proxies_;
};

struct Row {
    std::string name, peer;
    double ours, theirs, atMost, aim;
};

struct Bench {
    int passes = 6;
    std::map<std::string, std::vector<double>> older;  ///< ratios with sse41, by case
    std::map<std::string, std::size_t> seen;
    std::vector<Row> rows;
    bool good = true;

    /// Mean microseconds per frame, for each contender.
    std::vector<double> race(const Motion& motion, const std::vector<Contender*>& contenders);
    void add(Row row) {
        std::printf("%-26s %-30s %11.1f %11.1f %8.3f", row.name.c_str(), row.peer.c_str(), row.ours, row.theirs,
                    row.ours / row.theirs);
        if (row.atMost > 0) std::printf(" %8.2f %8.2f", row.atMost, row.aim);
        if (const auto known = older.find(row.name); known != older.end())
            if (const std::size_t place = seen[row.name]++; place < known->second.size())
                std::printf("   sse41 %.3f", known->second[place]);
        std::printf("\n");
        std::fflush(stdout);
        rows.push_back(std::move(row));
    }
    void everybodyMoves(std::size_t n, std::size_t frames, double atMost, double aim, bool leap = false);
    void tenthMoves(std::size_t n, std::size_t frames, double atMost, double aim);
    void twoThreads(std::size_t n, std::size_t frames);
    void ownMethods(std::size_t n, std::size_t frames);
};

std::vector<double> Bench::race(const Motion& motion, const std::vector<Contender*>& contenders) {
    const CallTimer timer;
    const std::size_t last = motion.frames.size() - 1;
    std::vector<double> best(contenders.size(), std::numeric_limits<double>::infinity());
    for (Contender* contender : contenders) contender->start(motion);
    Pairs expected;
    for (int pass = 0; pass <= passes; ++pass)
        for (std::size_t c = 0; c < contenders.size(); ++c) {
            Contender& contender = *contenders[c];
            double seconds = 0;
            for (std::size_t k = 1; k <= last; ++k) {
                const std::size_t f = pass % 2 == 0 ? k : last - k;
                const auto call = [&] { contender.frame(motion, f); };
                seconds += contender.threads ? timer.wallSeconds(call) : timer.seconds(call);
            }
            if (pass > 0) {
                best[c] = std::min(best[c], 1e6 * seconds / static_cast<double>(last));
                continue;
            }
            const Pairs pairs = contender.found(motion.frames[last]);
            if (c == 0) expected = pairs;
            if (pairs != expected) {
                std::fprintf(stderr, "bench_neighbours: %s finds %zu pairs, %s %zu or others\n", contender.name.c_str(),
                             pairs.size(), contenders[0]->name.c_str(), expected.size());
                good = false;
            }
        }
    return best;
}

void Bench::everybodyMoves(std::size_t n, std::size_t frames, double atMost, double aim, bool leap) {
    const Motion motion = makeMotion(n, frames, 1, 1, leap);
    Ours ours("auto", NeighbourMethod::kAuto, 1);
    Embree low("Embree, built anew (low)", RTC_BUILD_QUALITY_LOW),
        medium("Embree, built anew (medium)", RTC_BUILD_QUALITY_MEDIUM);
    Bullet dbvt("Bullet dbvt", false), sweep("Bullet axis sweep", true);
    std::vector<Contender*> all{&ours, &low, &medium};
    if (n <= 10'000) all.push_back(&dbvt);
    // A sweep that has everything to sort anew takes seconds a frame.
    if (n <= (leap ? 1'000 : 10'000)) all.push_back(&sweep);
    const std::vector<double> us = race(motion, all);
    const std::string name = (leap ? "all leap, " : "all move, ") + std::to_string(n);
    for (std::size_t c = 1; c < all.size(); ++c) {
        const bool claim = c <= 2 && us[c] <= std::min(us[1], us[2]);  // the better of the two builds
        add({name, all[c]->name, us[0], us[c], claim ? atMost : 0, claim ? aim : 0});
    }
}

void Bench::tenthMoves(std::size_t n, std::size_t frames, double atMost, double aim) {
    const Motion motion = makeMotion(n, frames, 10, 2);
    Ours ours("auto", NeighbourMethod::kAuto, 1);
    Embree low("Embree, built anew (low)", RTC_BUILD_QUALITY_LOW), refit("Embree, refitted", RTC_BUILD_QUALITY_REFIT);
    Bullet dbvt("Bullet dbvt", false), sweep("Bullet axis sweep", true);
    std::vector<Contender*> all{&ours, &low, &refit, &dbvt};
    if (n <= 10'000) all.push_back(&sweep);  // beyond, its first frame alone takes minutes
    const std::vector<double> us = race(motion, all);
    const double best = *std::min_element(us.begin() + 1, us.end());
    for (std::size_t c = 1; c < all.size(); ++c)
        add({"10 % move, " + std::to_string(n), all[c]->name, us[0], us[c], us[c] <= best ? atMost : 0,
             us[c] <= best ? aim : 0});
}

/// By the clock on the wall: the second core must be free. More passes than elsewhere, because it seldom is.
void Bench::twoThreads(std::size_t n, std::size_t frames) {
    const Motion motion = makeMotion(n, frames, 1, 1);
    Ours one("one thread", NeighbourMethod::kAuto, 1), two("two threads", NeighbourMethod::kAuto, 2);
    one.threads = true;
    const int usual = passes;
    passes *= 5;
    const std::vector<double> us = race(motion, {&two, &one});
    passes = usual;
    add({"two threads, " + std::to_string(n), "one thread", us[0], us[1], 0.56, 0.52});
}

/// What auto chooses from.
void Bench::ownMethods(std::size_t n, std::size_t frames) {
    const Motion motion = makeMotion(n, frames, 1, 1);
    Ours one("auto", NeighbourMethod::kAuto, 1), grid("grid", NeighbourMethod::kGrid, 1);
    Ours tree("tree", NeighbourMethod::kTree, 1), sweep("sweep and prune", NeighbourMethod::kSweepAndPrune, 1);
    Ours all("all pairs", NeighbourMethod::kAllPairs, 1);
    std::vector<Contender*> contenders{&one, &grid, &tree};
    if (n <= 10'000) contenders.push_back(&sweep);
    if (n <= 1'000) contenders.push_back(&all);
    const std::vector<double> us = race(motion, contenders);
    for (std::size_t c = 1; c < contenders.size(); ++c)
        add({"all move, " + std::to_string(n), "our " + contenders[c]->name, us[0], us[c], 0, 0});
}

int bench(int argc, char** argv) {
    std::string json, only;
    bool quick = false;
    Bench bench;
    std::vector<std::string> words(argv + 1, argv + argc);
    if (std::erase(words, "--sse41") > 0) bench.older = ratiosOfOlderProcessor(words);
    quick = std::erase(words, "--quick") > 0;
    if (quick) bench.passes = 1;
    for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
        const std::string &option = words[i], &value = words[i + 1];
        if (option == "--json") json = value;
        if (option == "--passes") bench.passes = std::max(1, std::atoi(value.c_str()));
        if (option == "--only") only = value;
    }
    // To see that all works.
    const auto frames = [&](std::size_t usual) { return quick ? std::size_t{4} : usual; };
    std::printf("%-26s %-30s %11s %11s %8s %8s %8s\n", "µs per frame", "beside", "ours", "theirs", "ratio", "at most",
                "aim");
    const auto wants = [&](const char* what) { return only.empty() || only == what; };
    if (wants("all")) {
        bench.everybodyMoves(1'000, frames(120), 0.35, 0.2);
        bench.everybodyMoves(10'000, frames(60), 0.4, 0.2);
        bench.everybodyMoves(100'000, frames(30), 0.4, 0.15);
    }
    if (wants("leap")) {
        bench.everybodyMoves(1'000, frames(120), 0, 0, true);
        bench.everybodyMoves(10'000, frames(60), 0, 0, true);
        bench.everybodyMoves(100'000, frames(30), 0, 0, true);
    }
    if (wants("tenth")) {
        bench.tenthMoves(1'000, frames(120), 1.0, 0.6);
        bench.tenthMoves(10'000, frames(60), 0.6, 0.3);
        bench.tenthMoves(100'000, frames(30), 0.3, 0.1);
    }
    if (wants("threads")) {
        bench.twoThreads(10'000, frames(60));
        bench.twoThreads(100'000, frames(15));
    }
    if (wants("own")) {
        bench.ownMethods(1'000, frames(120));
        bench.ownMethods(10'000, frames(60));
        bench.ownMethods(100'000, frames(30));
    }
    std::string cases;
    for (const Row& row : bench.rows) {
        char line[512];
        std::snprintf(
            line, sizeof line,
            "%s\n{\"case\":\"%s\",\"peer\":\"%s\",\"ours\":%.6g,\"theirs\":%.6g,\"unit\":\"µs\",\"ratio\":%.6g,"
            "\"atMost\":%g,\"aim\":%g}",
            cases.empty() ? "" : ",", row.name.c_str(), row.peer.c_str(), row.ours, row.theirs, row.ours / row.theirs,
            row.atMost, row.aim);
        cases += line;
    }
    if (!json.empty()) std::ofstream(json) << "{\"cases\":[" << cases << "\n]}\n";
    return bench.good ? 0 : 1;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::bench(argc, argv);
}
