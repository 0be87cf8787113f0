#include "server/tools/CollideCommand.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <variant>

#include "common/base/Version.h"
#include "common/base/Workers.h"
#include "common/options/Options.h"
#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/query/SelfCollision.h"
#include "server/tools/CollideFreeform.h"
#include "server/tools/CollideRays.h"
#include "server/tools/SceneTriangles.h"

namespace tessera {

namespace {

using SteadyClock = std::chrono::steady_clock;

double microseconds(SteadyClock::time_point from, SteadyClock::time_point to) {
    return std::chrono::duration<double, std::micro>(to - from).count();
}

const std::map<std::string, CollideQuery> kQueries{
    {"any", CollideQuery::kAny},    {"all", CollideQuery::kAll},     {"distance", CollideQuery::kDistance},
    {"toi", CollideQuery::kImpact}, {"depth", CollideQuery::kDepth}, {"self", CollideQuery::kSelf},
    {"ray", CollideQuery::kRay}};
const std::map<std::string, Representation> kKinds{
    {"triangles", Representation::kTriangles},
    {"hull", Representation::kHull},
    {"heightfield", Representation::kHeightField},
    {"points", Representation::kPoints},
    {"spherical", Representation::kSpherical},
    {"distance-field", Representation::kDistanceField},
    {"spherical-bezier", Representation::kSphericalBezier},
    // Smooth: kFreeformKinds; compared with whatever is not as triangles.
    {"subdivision", Representation::kTriangles},
    {"loop", Representation::kTriangles},
    {"nurbs", Representation::kTriangles},
    {"bezier", Representation::kTriangles}};
const std::map<std::string, FreeformKind> kFreeformKinds{{"subdivision", FreeformKind::kSubdivision},
                                                         {"loop", FreeformKind::kLoop},
                                                         {"nurbs", FreeformKind::kNurbs},
                                                         {"bezier", FreeformKind::kBezier}};
const std::map<std::string, VolumeKind> kVolumes{{"sphere", VolumeKind::kSphere}, {"aabb", VolumeKind::kAabb},
                                                 {"obb", VolumeKind::kObb},       {"dop6", VolumeKind::kDop6},
                                                 {"dop14", VolumeKind::kDop14},   {"dop18", VolumeKind::kDop18},
                                                 {"dop26", VolumeKind::kDop26}};
const std::map<std::string, Realignment> kRealignments{{"planes", Realignment::kThreePlanes},
                                                       {"table", Realignment::kTable}};
const std::map<std::string, SplitRule> kSplits{{"area", SplitRule::kSurfaceArea},
                                               {"median", SplitRule::kLongestSideMedian},
                                               {"mean", SplitRule::kLongestSideMean},
                                               {"volume", SplitRule::kMinimumVolume}};

template <typename T>
std::vector<std::string> wordsOf(const std::map<std::string, T>& values) {
    std::vector<std::string> words;
    for (const auto& [word, value] : values) words.push_back(word);
    return words;
}

/// Two bodies ready to be asked.
struct Bodies {
    std::shared_ptr<CollisionShape> a, b;
};

using Model = std::variant<TriangleMesh, FilePoints>;

Expected<Model> load(const std::string& path, Representation as, const CollideArguments& arguments) {
    ImportOptions options{.assetFolders = arguments.assets, .allowUnconfined = arguments.allowUnconfined};
    if (arguments.importMemoryMib > 0) options.maxMemoryBytes = arguments.importMemoryMib << 20;
    std::vector<std::string> notes;
    const auto tell = [&] {
        for (const std::string& note : notes)
            fmt::print(stderr, "tessera-collide: {}{}\n", note.starts_with(path) ? "" : path + ": ", note);
    };
    if (as != Representation::kPoints) {
        Expected<TriangleMesh> mesh = readTriangles(path, options, &notes);
        if (!mesh) return tl::unexpected(mesh.error());
        tell();
        return std::move(*mesh);
    }
    Expected<FilePoints> points = readPoints(path, options, &notes);
    tell();
    if (points) points->radius = arguments.radius.value_or(points->radius);
    return points;
}

/// With the tree that queries begin with, so that its time counts as building.
Expected<std::shared_ptr<CollisionShape>> shapeOf(Model model, Representation as, unsigned level, double error,
                                                  const std::string& path, const TreeOptions& trees) {
    if (const auto* points = std::get_if<FilePoints>(&model)) {
        Expected<std::shared_ptr<CollisionShape>> made =
            CollisionShape::ofPoints(points->places, points->radius, trees);
        if (!made) return failWith(path, made.error());
        return made;
    }
    TriangleMesh& mesh = std::get<TriangleMesh>(model);
    if (level > 0) {
        Expected<std::shared_ptr<CollisionShape>> cover = CollisionShape::ofCover(std::move(mesh), level, trees);
        if (!cover) return failWith(fmt::format("{}, level {}", path, level), cover.error());
        return cover;
    }
    if (as == Representation::kHeightField) {
        Expected<std::shared_ptr<CollisionShape>> field = CollisionShape::ofHeightField(mesh, trees);
        if (!field) return failWith(path, field.error());
        return field;
    }
    if (as == Representation::kDistanceField) {
        Expected<std::shared_ptr<CollisionShape>> field =
            CollisionShape::ofDistanceField(std::move(mesh), error, trees);
        if (!field) return failWith(fmt::format("{}, --error {}", path, 100 * error), field.error());
        return field;
    }
    if (as == Representation::kSpherical) return CollisionShape::ofSphericalField(std::move(mesh), trees);
    if (as == Representation::kSphericalBezier) {
        Expected<std::shared_ptr<CollisionShape>> patches = CollisionShape::ofSphericalBezier(std::move(mesh), trees);
        if (patches) {
            (void)(*patches)->tree();
            return patches;
        }
        fmt::print(stderr, "tessera-collide: {}: {}; taken as triangles\n", path, patches.error().message);
    }
    std::shared_ptr<CollisionShape> shape = as == Representation::kHull
                                                ? CollisionShape::ofHull(mesh, trees)
                                                : CollisionShape::ofTriangles(std::move(mesh), trees);
    if (!shape) return fail(ErrorCode::kBadInput, fmt::format("{}: lies in one plane, so it has no hull", path));
    (void)shape->tree();
    return shape;
}

std::string answer(const Bodies& bodies, const PoseLine& pose, const CollideArguments& arguments, Workers* workers,
                   double& us) {
    const auto timed = [&](auto&& query) {
        const SteadyClock::time_point start = SteadyClock::now();
        QueryWork work;
        const auto result = query(work);
        us = microseconds(start, SteadyClock::now());
        return result;
    };
    const CollisionShape &a = *bodies.a, &b = *bodies.b;
    const PairMethods& methods = pairMethods(a, b);
    const Affine3d a_T_b = pose.start.matrix();
    const AnswerFormat format = arguments.format;
    const Affine3d here = Affine3d::Identity();
    const double error = coverError({a, here}, {b, a_T_b});
    const auto effort = [&](QueryWork& work) {
        return PairEffort{
            .work = work, .workers = workers, .realignment = arguments.realignment.value_or(Realignment::kThreePlanes)};
    };
    switch (arguments.query) {
        case CollideQuery::kAny:
            return answerLine(timed([&](QueryWork& work) { return methods.touch(a, b, a_T_b, effort(work)); }).touch,
                              format, error);
        case CollideQuery::kAll:
            return answerLine(
                timed([&](QueryWork& work) { return methods.contacts(a, b, a_T_b, ~std::size_t{0}, effort(work)); }),
                format, error);
        case CollideQuery::kDistance: {
            const Distance found = timed([&](QueryWork& work) {
                return methods.distance(a, b, a_T_b, work, {.tolerance = arguments.tolerance.value_or(0)});
            });
            return answerLine(found, format, std::max(error, found.error));
        }
        case CollideQuery::kImpact:
            return answerLine(timed([&](QueryWork& work) {
                                  return methods.firstContact(
                                      a, BodyMotion{}, b, BodyMotion{pose.start, *pose.end}, work,
                                      {.tolerance = arguments.tolerance.value_or(ImpactOptions{}.tolerance)});
                              }),
                              format, error);
        case CollideQuery::kDepth: {
            const PairDepth found = timed([&](QueryWork& work) { return methods.depth({a, here}, {b, a_T_b}, work); });
            return answerLine(found, a.isCover() || b.isCover() ? std::nullopt : std::optional(found.error), format);
        }
        case CollideQuery::kSelf:
        case CollideQuery::kRay:  // CollideRays.h
            break;
    }
    FacePairs found =
        timed([&](QueryWork& work) { return selfTouching(a.tree(), work, {.weldEqualPositions = true}); });
    PairTouch self;
    self.complete = found.complete;
    self.count = found.pairs.size();
    self.faces = std::move(found.pairs);
    return answerLine(self, format);
}

/// Asks again, by one thread and out of the time that is told: which boxes were tested, and how large they are in A's
/// frame.
void measureBoxes(const Bodies& bodies, const PoseLine& pose, const CollideArguments& arguments, RealignedBoxes& to) {
    const CollisionShape &a = *bodies.a, &b = *bodies.b;
    const PairMethods& methods = pairMethods(a, b);
    QueryWork work;
    const PairEffort effort{.work = work, .realignment = *arguments.realignment, .placed = &to.placed};
    const Affine3d a_T_b = pose.start.matrix();
    if (arguments.query == CollideQuery::kAny)
        (void)methods.touch(a, b, a_T_b, effort);
    else
        (void)methods.contacts(a, b, a_T_b, ~std::size_t{0}, effort);
    to.tests += work.boxTests;
}

/// Says how far it is where the answers go elsewhere and somebody looks on, from the first second on.
class ProgressLine {
public:
    explicit ProgressLine(std::size_t total)
        : total_(total), shown_(isatty(STDERR_FILENO) != 0 && isatty(STDOUT_FILENO) == 0) {}
    ~ProgressLine() {
        if (drawn_) fmt::print(stderr, "\r\x1b[K");
    }
    void at(std::size_t done) {
        if (!shown_) return;
        const SteadyClock::time_point now = SteadyClock::now();
        if (now - last_ < std::chrono::seconds(1)) return;
        last_ = now;
        drawn_ = true;
        constexpr std::size_t kWidth = 40;
        const std::size_t full = total_ > 0 ? kWidth * done / total_ : 0;
        fmt::print(stderr, "\r[{:<{}}] {} of {}", std::string(full, '#'), kWidth, done, total_);
    }

private:
    std::size_t total_;
    bool shown_, drawn_ = false;
    SteadyClock::time_point last_ = SteadyClock::now();
};

Expected<void> collideFreeform(const CollideArguments& arguments, const std::vector<PoseLine>& poses) {
    const SteadyClock::time_point start = SteadyClock::now();
    BezierFaces facesA, facesB;
    const Expected<FreeformShape> a = loadFreeform(arguments.a, arguments.freeformA, arguments.asA, arguments, &facesA);
    if (!a) return tl::unexpected(a.error());
    const Expected<FreeformShape> b = loadFreeform(arguments.b, arguments.freeformB, arguments.asB, arguments, &facesB);
    if (!b) return tl::unexpected(b.error());
    QueryTimes times{.buildUs = microseconds(start, SteadyClock::now()), .instructionSet = name(instructionSet())};
    FreeformPair pair(*a, *b);
    ProgressLine progress(poses.size());
    bool written = true;
    const auto write = [&](std::string line) {
        line += '\n';
        written = written && std::fwrite(line.data(), 1, line.size(), stdout) == line.size();
    };
    for (const PoseLine& pose : poses) {
        double us = 0;
        write(freeformAnswer(pair, pose, arguments, us, facesA, facesB));
        times.queryUs.push_back(us);
        progress.at(times.queryUs.size());
        if (!written) break;
    }
    times.faces = {a->faceCount(), b->faceCount()};
    times.bytes = {a->memoryBytes(), b->memoryBytes()};
    if (arguments.time) write(timeLine(times, arguments.format));
    if (std::fflush(stdout) != 0 || !written)
        return fail(ErrorCode::kFailed, "the answers cannot be written to stdout");
    return {};
}

Expected<void> collide(const CollideArguments& arguments) {
    if (arguments.query == CollideQuery::kRay) return collideRays(arguments);
    const bool alone = arguments.query == CollideQuery::kSelf;
    const Expected<std::vector<PoseLine>> poses =
        alone ? Expected<std::vector<PoseLine>>(std::vector<PoseLine>(1)) : readPoses(arguments.poses);
    if (!poses) return tl::unexpected(poses.error());
    if (const Expected<void> fits = checkPosesFor(arguments.query, *poses, arguments.poses); !fits) return fits;

    const bool smooth = arguments.freeformA || arguments.freeformB;
    // What smooth surfaces are asked for beside fields, and their depth, the table of representations answers.
    const auto isField = [](Representation as) {
        return as == Representation::kSpherical || as == Representation::kDistanceField ||
               as == Representation::kSphericalBezier;
    };
    const bool fieldA = !arguments.freeformA && isField(arguments.asA),
               fieldB = !arguments.freeformB && isField(arguments.asB);
    if (smooth && !fieldA && !fieldB && arguments.query != CollideQuery::kDepth)
        return collideFreeform(arguments, *poses);
    Expected<Model> a = smooth && !fieldA ? Model() : load(arguments.a, arguments.asA, arguments);
    if (!a) return tl::unexpected(a.error());
    const bool same = arguments.b == arguments.a &&
                      (arguments.asA == Representation::kPoints) == (arguments.asB == Representation::kPoints);
    Expected<Model> b =
        alone || (same && !smooth) || (smooth && !fieldB) ? a : load(arguments.b, arguments.asB, arguments);
    if (!b) return tl::unexpected(b.error());

    const SteadyClock::time_point start = SteadyClock::now();
    const Expected<std::shared_ptr<CollisionShape>> shapeA =
        smooth && !fieldA
            ? loadFreeformShape(arguments.a, arguments.freeformA, arguments.asA, arguments)
            : shapeOf(std::move(*a), arguments.asA, arguments.levelA, arguments.error, arguments.a, arguments.tree);
    if (!shapeA) return tl::unexpected(shapeA.error());
    const Expected<std::shared_ptr<CollisionShape>> shapeB =
        alone ? shapeA
        : smooth && !fieldB
            ? loadFreeformShape(arguments.b, arguments.freeformB, arguments.asB, arguments)
            : shapeOf(std::move(*b), arguments.asB, arguments.levelB, arguments.error, arguments.b, arguments.tree);
    if (!shapeB) return tl::unexpected(shapeB.error());
    const Bodies bodies{*shapeA, *shapeB};
    if (arguments.query == CollideQuery::kDepth)
        for (const auto& [shape, path] : {std::pair(bodies.a, arguments.a), std::pair(bodies.b, arguments.b)})
            if (shape->distanceField() != nullptr && !shape->distanceField()->isSigned())
                return fail(
                    ErrorCode::kBadInput,
                    fmt::format("{}: an open surface has no inside, so as a distance field it has no depth", path));
    QueryTimes times{.buildUs = microseconds(start, SteadyClock::now()),
                     .threads = arguments.threads,
                     .instructionSet = name(instructionSet())};
    if (arguments.realignment) times.boxes.emplace();

    std::optional<Workers> workers;
    if (arguments.threads > 1) workers.emplace(arguments.threads);
    ProgressLine progress(poses->size());
    bool written = true;
    const auto write = [&](std::string line) {
        line += '\n';
        written = written && std::fwrite(line.data(), 1, line.size(), stdout) == line.size();
    };
    for (const PoseLine& pose : *poses) {
        double us = 0;
        write(answer(bodies, pose, arguments, workers ? &*workers : nullptr, us));
        times.queryUs.push_back(us);
        if (arguments.time && times.boxes) measureBoxes(bodies, pose, arguments, *times.boxes);
        progress.at(times.queryUs.size());
        if (!written) break;
    }
    times.faces = {bodies.a->faceCount(), bodies.b->faceCount()};
    times.bytes = {bodies.a->memoryBytes(), bodies.b->memoryBytes()};
    if (arguments.time) write(timeLine(times, arguments.format));
    if (std::fflush(stdout) != 0 || !written)
        return fail(ErrorCode::kFailed, "the answers cannot be written to stdout");
    return {};
}

}  // namespace

Expected<std::variant<CollideArguments, CollideHelp>> parseCollideArguments(const std::vector<std::string>& words) {
    CollideArguments out;
    std::string query, volume, split, realignment, asA, asB;
    double tolerance = 0;
    Options options("tessera-collide",
                    "Asks of two models, pose by pose: do they touch, where, how deep, how far\n"
                    "are they apart, when do they meet? One answer per line of the pose file.\n"
                    "Or of one: what of it runs into itself (self), what does a ray meet first (ray)?",
                    versionText("tessera-collide"));
    options.option("A", out.a, "A scene or model file; stays").required();
    options.option("B", out.b, "Another, or the same; moves");
    options
        .option("--poses", out.poses,
                "Of B relative to A, a line each:\ntx ty tz qw qx qy qz; two for toi;\nof ray ox oy oz dx dy dz")
        .typeName("FILE");
    options.option("--query", query, "any, all, distance, toi, depth, self, ray")
        .typeName("Q")
        .required()
        .oneOf(wordsOf(kQueries), ShowValues::kInErrorsAlone);
    bool json = false;
    options.flag("--json", json, "One JSON object per answer");
    options.flag("--time", out.time, "A last line: what it took");
    const Option toleranceOption = options
                                       .option("--tolerance", tolerance,
                                               "toi: a distance that is a hit (1e-4);\ndistance: may be so much too "
                                               "large (0);\nsmooth surfaces: of any answer (1e-6)")
                                       .typeName("T");
    options.option("--threads", out.threads, "For any and all (1)").typeName("N").range(1, 256);
    options
        .option("--as-a", asA,
                "A as triangles, hull, heightfield, points,\nspherical, spherical-bezier or\ndistance-field; or as "
                "OBJ's smooth\nsurfaces: subdivision (Catmull-Clark),\nits approximation by patches, bezier,\nloop, "
                "nurbs (triangles)")
        .typeName("KIND")
        .oneOf(wordsOf(kKinds), ShowValues::kInErrorsAlone);
    options.option("--as-b", asB, "The same of B").typeName("KIND").oneOf(wordsOf(kKinds), ShowValues::kInErrorsAlone);
    std::string levelA, levelB;
    const Option levelAOption =
        options
            .option("--level-a", levelA,
                    "A as balls that cover it; 1 to 12, each\nhalf as large as the last; 0: as it is")
            .typeName("N");
    const Option levelBOption = options.option("--level-b", levelB, "The same of B").typeName("N");
    double error = 1;
    const Option errorOption =
        options
            .option("--error", error,
                    "Distances and depths by distance\nfields may be wrong by so many\npercent of their size (1)")
            .typeName("E");
    double radius = 0;
    const Option radiusOption = options.option("--radius", radius, "Of points; else the file's").typeName("R");
    options
        .option("--volume", volume,
                "sphere, aabb, obb, dop6, dop14, dop18,\ndop26; times of contact may differ\nwithin the tolerance, "
                "nothing else")
        .typeName("V")
        .oneOf(wordsOf(kVolumes), ShowValues::kInErrorsAlone);
    options.option("--split", split, "area, median, mean, volume;\nas --volume")
        .typeName("S")
        .oneOf(wordsOf(kSplits), ShowValues::kInErrorsAlone);
    options
        .option("--realignment", realignment,
                "any and all on k-DOPs (dop18): planes or\ntable; --time tells the boxes tested and\ntheir volume, "
                "nothing else differs")
        .typeName("R")
        .oneOf(wordsOf(kRealignments), ShowValues::kInErrorsAlone);
    options.option("--assets", out.assets, "Folders for asset://NAME").typeName("DIR");
    options
        .option("--import-memory", out.importMemoryMib,
                "What reading one file may take at least;\nlarge ones may take more by themselves")
        .typeName("MIB")
        .range(256, 1'000'000);
    options.flag("--allow-unconfined-import", out.allowUnconfined, "Import even where the child cannot\nbe confined");
    const Expected<std::optional<std::string>> instead = options.read(words);
    if (!instead) return fail(instead.error().code, instead.error().message + "; see --help");
    if (*instead) return CollideHelp{**instead};
    out.query = kQueries.at(query);
    if (!asA.empty()) out.asA = kKinds.at(asA);
    if (!asB.empty()) out.asB = kKinds.at(asB);
    if (const auto kind = kFreeformKinds.find(asA); kind != kFreeformKinds.end()) out.freeformA = kind->second;
    if (const auto kind = kFreeformKinds.find(asB); kind != kFreeformKinds.end()) out.freeformB = kind->second;
    const bool alone = out.query == CollideQuery::kSelf;
    if (alone && !(out.b.empty() && out.poses.empty() && asB.empty()))
        return fail(ErrorCode::kUsage, "self is about A alone: no B, no --poses, no --as-b");
    if (out.query == CollideQuery::kRay) {
        if (!out.b.empty() || !asA.empty() || !asB.empty() || !volume.empty() || !split.empty() ||
            !realignment.empty() || levelAOption.given() || levelBOption.given() || toleranceOption.given() ||
            errorOption.given() || radiusOption.given() || out.threads > 1 || out.time)
            return fail(ErrorCode::kUsage,
                        "ray is about A as it is drawn: no B, and nothing but --poses, --json and --assets");
        if (out.poses.empty()) return fail(ErrorCode::kUsage, "--poses is required, a ray on each line; see --help");
        out.format = json ? AnswerFormat::kJson : AnswerFormat::kText;
        return out;
    }
    if (!alone && out.b.empty()) return fail(ErrorCode::kUsage, "B is required; see --help");
    if (!alone && out.poses.empty()) return fail(ErrorCode::kUsage, "--poses is required; see --help");
    out.format = json ? AnswerFormat::kJson : AnswerFormat::kText;
    if (!volume.empty()) out.tree.volume = kVolumes.at(volume);
    if (!split.empty()) out.tree.split = kSplits.at(split);
    if (!realignment.empty()) {
        const auto isSurface = [](Representation as, const std::optional<FreeformKind>& smooth) {
            return as == Representation::kTriangles && !smooth;
        };
        if (out.query != CollideQuery::kAny && out.query != CollideQuery::kAll)
            return fail(ErrorCode::kUsage, fmt::format("--realignment is for any and all, not for {}", query));
        if (!isSurface(out.asA, out.freeformA) || !isSurface(out.asB, out.freeformB) || levelAOption.given() ||
            levelBOption.given())
            return fail(ErrorCode::kUsage, "--realignment is for triangles on both sides, without levels");
        if (volume.empty()) out.tree.volume = VolumeKind::kDop18;
        const VolumeKind kind = out.tree.volume;
        if (kind != VolumeKind::kDop14 && kind != VolumeKind::kDop18 && kind != VolumeKind::kDop26)
            return fail(ErrorCode::kUsage,
                        fmt::format("--realignment is for --volume dop14, dop18 and dop26, not for {}", volume));
        out.realignment = kRealignments.at(realignment);
        out.tree.profiles = out.realignment == Realignment::kTable;
    }
    if (toleranceOption.given()) {
        const bool zeroWillDo = out.query != CollideQuery::kImpact;
        if (!std::isfinite(tolerance) || tolerance < 0 || (tolerance == 0 && !zeroWillDo))
            return fail(ErrorCode::kUsage,
                        fmt::format("--tolerance must be a number {} 0", zeroWillDo ? "of at least" : "above"));
        out.tolerance = tolerance;
    }
    const bool points = out.asA == Representation::kPoints || out.asB == Representation::kPoints;
    if (alone && points) return fail(ErrorCode::kUsage, "self is about surfaces: points run into nothing of theirs");
    const auto takeLevel = [](const Option& option, const std::string& word, Representation as,
                              unsigned& to) -> Expected<void> {
        if (!option.given()) return {};
        const char* const end = word.data() + word.size();
        const auto [rest, wrong] = std::from_chars(word.data(), end, to);
        if (wrong != std::errc() || rest != end || to > kFinestLevel)
            return fail(ErrorCode::kUsage,
                        fmt::format("{} must be a whole number from 0 to {}", option.name(), kFinestLevel));
        if (as != Representation::kTriangles && as != Representation::kHeightField)
            return fail(ErrorCode::kUsage, fmt::format("{} is for triangles and height fields", option.name()));
        return {};
    };
    if (alone && (levelAOption.given() || levelBOption.given()))
        return fail(ErrorCode::kUsage, "self looks at the surface itself: no levels");
    if (const Expected<void> good = takeLevel(levelAOption, levelA, out.asA, out.levelA); !good)
        return tl::unexpected(good.error());
    if (const Expected<void> good = takeLevel(levelBOption, levelB, out.asB, out.levelB); !good)
        return tl::unexpected(good.error());
    if (errorOption.given()) {
        if (alone || (out.asA != Representation::kDistanceField && out.asB != Representation::kDistanceField))
            return fail(ErrorCode::kUsage, "--error is for --as-a distance-field and --as-b distance-field");
        if (!(error >= 0.1 && error <= 20))
            return fail(ErrorCode::kUsage, "--error must be a number of percent, from 0.1 to 20");
        out.error = 0.01 * error;
    }
    if (radiusOption.given()) {
        if (!points) return fail(ErrorCode::kUsage, "--radius is for --as-a points and --as-b points");
        if (!std::isfinite(radius) || radius < 0)
            return fail(ErrorCode::kUsage, "--radius must be a number of at least 0");
        out.radius = radius;
    }
    if (out.freeformA || out.freeformB) {
        const auto isLike = [](const std::optional<FreeformKind>& kind, Representation as) {
            return kind || (as != Representation::kPoints && as != Representation::kHeightField);
        };
        if (alone)
            return fail(ErrorCode::kUsage, "self is not for smooth surfaces: any, all, distance, toi and depth are");
        if (!isLike(out.freeformA, out.asA) || !isLike(out.freeformB, out.asB))
            return fail(
                ErrorCode::kUsage,
                "smooth surfaces are compared with each other, triangles, hulls, spherical and distance fields");
        if (out.levelA > 0 || out.levelB > 0)
            return fail(ErrorCode::kUsage, "--level is for triangles and height fields, not beside smooth surfaces");
        if (out.threads > 1) return fail(ErrorCode::kUsage, "smooth surfaces take one thread");
        const auto isOfPatches = [](const std::optional<FreeformKind>& kind, Representation as) {
            return kind || as == Representation::kTriangles || as == Representation::kHull;
        };
        const bool isBezier = out.freeformA == FreeformKind::kBezier || out.freeformB == FreeformKind::kBezier;
        if (isBezier && out.query == CollideQuery::kDepth)
            return fail(ErrorCode::kUsage, "bezier has no depth: subdivision has");
        if (isBezier && !(isOfPatches(out.freeformA, out.asA) && isOfPatches(out.freeformB, out.asB)))
            return fail(ErrorCode::kUsage, "bezier is compared with smooth surfaces, triangles and hulls");
    }
    if (out.threads > 1 && out.query != CollideQuery::kAny && out.query != CollideQuery::kAll)
        return fail(ErrorCode::kUsage, fmt::format("--threads is for any and all; {} takes one thread", query));
    return out;
}

Expected<void> checkPosesFor(CollideQuery query, const std::vector<PoseLine>& poses, const std::string& file) {
    const bool motions = query == CollideQuery::kImpact;
    for (const PoseLine& pose : poses)
        if (pose.end.has_value() != motions)
            return fail(ErrorCode::kBadInput, fmt::format("{}:{}: {}", file, pose.line,
                                                          motions ? "7 numbers; toi needs the end of the motion too, 14"
                                                                  : "14 numbers, a motion, is for toi; a pose has 7"));
    return {};
}

int runCollide(const std::vector<std::string>& words) {
    const auto parsed = parseCollideArguments(words);
    const Expected<void> done = [&]() -> Expected<void> {
        if (!parsed) return tl::unexpected(parsed.error());
        if (const auto* help = std::get_if<CollideHelp>(&*parsed)) {
            fmt::print("{}", help->text);
            return {};
        }
        return collide(std::get<CollideArguments>(*parsed));
    }();
    if (done) return 0;
    fmt::print(stderr, "tessera-collide: {}\n", done.error().message);
    return exitCode(done.error().code);
}

}  // namespace tessera
