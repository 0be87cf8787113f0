/// 10,000 convex bodies, about a hundredth of them touching: our frame beside Bullet's collision world on the same
/// hulls and poses.
///
/// Bullet's frame is: tell it the poses, boxes, pairs, contacts (detection only). It keeps contacts up to 0.02 apart
/// and computes with single precision; pairs that only one side takes for touching must be as near to touching as that
/// lets expect, and the exact distance (or depth) of each says whether they are.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>

#include "common/base/Workers.h"
#include "server/collision/convex/ConvexQuery.h"
#include "tests/bench/PipelineBullet.h"
#include "tests/bench/PipelineMotion.h"
#include "tests/bench/PipelineRace.h"
#include "tests/bench/PipelineRows.h"

namespace tessera {

namespace {

/// Which hull, and where in each frame.
struct Flock {
    std::vector<MeshArrays3> hulls;
    std::vector<std::uint32_t> hullOf;
    BodyFrames frames;
};

Flock makeFlock(std::size_t hulls, BodyFrames frames) {
    Flock flock{makeHulls(hulls, 1), {}, std::move(frames)};
    for (std::size_t i = 0; i < flock.frames.bodies(); ++i)
        flock.hullOf.push_back(static_cast<std::uint32_t>(i % hulls));
    return flock;
}

class OurFlock final : public FrameContender {
public:
    OurFlock(const Flock& flock, std::int64_t detail, unsigned threads = 1)
        : workers_(threads), scene_(threads > 1 ? &workers_ : nullptr) {
        for (const MeshArrays3& hull : flock.hulls) shapes_.push_back(scene_.addShape(hull));
        const ObjectId group = scene_.addGroup(CollisionObject::kRigid, CollisionObject::kHull);
        for (std::size_t i = 0; i < flock.hullOf.size(); ++i)
            scene_.addBody(group, shapes_[flock.hullOf[i]], flock.frames.poses[0][i]);
        scene_.addInterest(group, group, {.detail = detail});
        scene_.open();
        wishes_ = flock.frames.wishes(scene_);
    }
    void start() override {
        scene_.put(wishes_[0]);
        (void)scene_.frame(wishes_[0], FrameClock(Clock::kThread));
    }
    FrameTimes frame(std::size_t f, const FrameClock& clock) override { return scene_.frame(wishes_[f], clock); }
    void look(std::size_t) override {
        found.push_back(scene_.touching());
        neighbours += scene_.result().counters.neighbours;
    }

    std::vector<BodyPairs> found;
    std::size_t neighbours = 0;

private:
    Workers workers_;
    PipelineScene scene_;
    std::vector<std::uint32_t> shapes_;
    std::vector<std::vector<TentativeTransform>> wishes_;
};

class BulletFlock final : public FrameContender {
public:
    BulletFlock(const Flock& flock, double margin) : world_(margin) {
        std::vector<std::uint32_t> shapes;
        for (const MeshArrays3& hull : flock.hulls) shapes.push_back(world_.addHull(hull));
        std::vector<bool> moves(flock.hullOf.size());
        for (const std::uint32_t i : flock.frames.movers) moves[i] = true;
        for (std::size_t i = 0; i < flock.hullOf.size(); ++i)
            world_.addBody(shapes[flock.hullOf[i]], flock.frames.poses[0][i], moves[i]);
        world_.addFrames(flock.frames.poses, flock.frames.movers);
    }
    void start() override {
        world_.put(0);
        world_.detect();
    }
    FrameTimes frame(std::size_t f, const FrameClock& clock) override {
        const double seconds = clock.seconds([&] {
            world_.put(f);
            world_.detect();
        });
        return {seconds, seconds};
    }
    void look(std::size_t) override { found.push_back(world_.touching()); }

    std::vector<BodyPairs> found;

private:
    BulletWorld world_;
};

/// Pairs that only one of two finds, and how far from touching the worst of them is. `wrong`: those of them in which
/// exact arithmetic contradicts us.
struct Difference {
    std::size_t onlyOurs = 0, onlyTheirs = 0, wrong = 0;
    double worst = 0;
};

Difference differenceOf(const Flock& flock, const std::vector<BodyPairs>& ours, const std::vector<BodyPairs>& theirs) {
    std::vector<ConvexHull> hulls;
    for (const MeshArrays3& arrays : flock.hulls) {
        std::vector<Vec3d> points;
        for (std::size_t v = 0; v < arrays.positions.size(); v += 3)
            points.emplace_back(arrays.positions[v], arrays.positions[v + 1], arrays.positions[v + 2]);
        hulls.push_back(*ConvexHull::make(points));
    }
    std::vector<bool> moves(flock.hullOf.size());
    for (const std::uint32_t i : flock.frames.movers) moves[i] = true;
    Difference out;
    for (std::size_t f = 0; f < ours.size(); ++f) {
        const std::vector<Pose>& poses = flock.frames.poses[f + 1];
        BodyPairs only;
        std::set_symmetric_difference(ours[f].begin(), ours[f].end(), theirs[f].begin(), theirs[f].end(),
                                      std::back_inserter(only));
        for (const auto& pair : only) {
            // Bullet does not look at pairs of sleepers.
            if (!moves[pair.first] && !moves[pair.second]) continue;
            const bool our = std::binary_search(ours[f].begin(), ours[f].end(), pair);
            (our ? out.onlyOurs : out.onlyTheirs) += 1;
            ConvexWork work;
            const Affine3d a_T_b = poses[pair.first].matrix().inverse() * poses[pair.second].matrix();
            const HullDepth depth =
                hullDepth(hulls[flock.hullOf[pair.first]], hulls[flock.hullOf[pair.second]], a_T_b, work);
            out.wrong += depth.touching != our;
            out.worst = std::max(out.worst, std::abs(depth.depth));
        }
    }
    return out;
}

/// Mean share of bodies that touch another, and mean number of pairs.
std::string shareOf(const std::vector<BodyPairs>& found, std::size_t bodies) {
    double touching = 0, pairs = 0;
    for (const BodyPairs& frame : found) {
        std::vector<bool> touches(bodies);
        for (const auto& [a, b] : frame) touches[a] = touches[b] = true;
        touching += static_cast<double>(std::count(touches.begin(), touches.end(), true));
        pairs += static_cast<double>(frame.size());
    }
    const double frames = static_cast<double>(std::max<std::size_t>(1, found.size()));
    return fmt::format("{:.2f} % ({:.0f} pairs)", 100 * touching / frames / static_cast<double>(bodies),
                       pairs / frames);
}

struct Case {
    std::string name;
    std::size_t bodies = 10'000, hulls = 200;
    double volume = 200;  ///< of the cube, per body
    double spacing = 0;   ///< of the lattice; 0: they fly
    std::size_t everyNth = 1;
    double atMost = 0;
};

void convexCase(const Case& c, const PipelineOptions& options, CollisionTable& table) {
    const std::size_t frames = options.quick ? 5 : 20;
    const std::size_t bodies = options.quick ? c.bodies / 10 : c.bodies;
    const Flock flock = makeFlock(c.hulls, c.spacing > 0 ? packedBodies(bodies, c.spacing, frames, 2)
                                                         : flyingBodies(bodies, c.volume, c.everyNth, frames, 2));
    OurFlock yesOrNo(flock, Interest::kYesOrNo), contacts(flock, Interest::kAllFaces);
    BulletFlock bullet(flock, 0), usual(flock, kBulletMargin);
    const RaceTimes times = raceFrames(frames, options.passes, {&yesOrNo, &contacts, &bullet, &usual});

    const Difference difference = differenceOf(flock, contacts.found, bullet.found);
    if (difference.wrong > 0 || yesOrNo.found != contacts.found)
        table.complain(fmt::format("{}: {} pairs only ours, {} only Bullet's; in {} of them we are wrong{}", c.name,
                                   difference.onlyOurs, difference.onlyTheirs, difference.wrong,
                                   yesOrNo.found != contacts.found ? "; yes-or-no finds others than contacts" : ""));
    const std::string remark = fmt::format(
        "touching: ours {}, Bullet {}; {} and {} pairs known to one side alone, at most {:.1e} from touching; {:.0f} "
        "neighbours",
        shareOf(contacts.found, flock.hullOf.size()), shareOf(bullet.found, flock.hullOf.size()), difference.onlyOurs,
        difference.onlyTheirs, difference.worst,
        static_cast<double>(contacts.neighbours) / static_cast<double>(frames));
    const std::string name = "convex: " + c.name;
    const auto add = [&](const std::string& what, const std::vector<double>& seconds, double atMost,
                         const std::string& r, bool margin = false) {
        table.add({.pair = name,
                   .operation = what,
                   .peer = margin ? "Bullet, its own margin" : "Bullet, detection",
                   .ours = summarise(seconds),
                   .theirs = summarise(times.asked[margin ? 3 : 2]),
                   .atMost = atMost,
                   .aim = 0.6 * atMost,
                   .remark = r});
    };
    add("yes or no, step", times.asked[0], c.atMost, "");
    add("contacts, step", times.asked[1], c.atMost, remark);
    // Two hulls that are 0.08 apart touch there: not the same question, but the one that its users ask.
    add("contacts, step", times.asked[1], 0, "touching there: " + shareOf(usual.found, flock.hullOf.size()), true);
    add("contacts, with commit", times.whole[1], 0, "");
}

/// By the clock on the wall; the second core must be free.
void convexThreads(const PipelineOptions& options, CollisionTable& table) {
    const std::size_t frames = options.quick ? 5 : 20;
    const Flock flock = makeFlock(200, flyingBodies(options.quick ? 1'000 : 10'000, 200, 1, frames, 2));
    OurFlock one(flock, Interest::kAllFaces), two(flock, Interest::kAllFaces, 2);
    const RaceTimes times = raceFrames(frames, 3 * options.passes, {&two, &one}, Clock::kWall);
    if (one.found != two.found) table.complain("convex: two threads find others than one");
    table.add({.pair = "convex: 10k",
               .operation = "contacts, step, two threads",
               .peer = "one thread",
               .ours = summarise(times.asked[0]),
               .theirs = summarise(times.asked[1])});
}

}  // namespace

void convexRows(const PipelineOptions& options, CollisionTable& table) {
    if (options.wants("convex")) {
        convexCase({.name = "10k", .atMost = 0.5}, options, table);
        convexCase({.name = "10k, all hulls equal", .hulls = 1}, options, table);
        convexCase({.name = "10k, a tenth moves", .everyNth = 10}, options, table);
        convexCase({.name = "10k, packed", .spacing = 1.135, .atMost = 0.5}, options, table);
        convexCase({.name = "10k, dense", .volume = 6}, options, table);
        convexCase({.name = "1k", .bodies = 1'000}, options, table);
    }
    if (options.wants("threads")) convexThreads(options, table);
}

}  // namespace tessera
