#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <utility>

#include "client/replica/TilePainter.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/SpotLight.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "tests/bench/DrawingRows.h"
#include "tests/bench/DrawingStage.h"

namespace tessera::bench {
namespace {

constexpr double kAt = 0.3;  // of the way down the street

/// On a ground.
City cityOnGround() {
    City city = makeCity();
    city.places.push_back({0, {0, -0.05, 0}, {600, 0.1, 600}});
    return city;
}

/// Where its things are and their transforms, whose ids are in a row (SceneWriter).
struct ShadowCity {
    std::vector<ObjectId> transforms;
    std::vector<Vec3d> places;
    ObjectId next;
};
ShadowCity makeShadowCity() {
    const City city = cityOnGround();
    ShadowCity made;
    std::uint64_t id = 2 + city.meshes.size();
    for (const City::Place& place : city.places) {
        made.transforms.push_back(ObjectId{id});
        made.places.push_back(place.at);
        id += 3;
    }
    made.next = ObjectId{id};
    return made;
}

/// The things nearest to a place, without the houses and the ground.
std::vector<std::size_t> nearestTo(const ShadowCity& city, const Vec3d& at, std::size_t count) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i + 1 < city.places.size(); ++i)
        if (i % 21 != 0) found.push_back(i);
    std::ranges::sort(found, {}, [&](std::size_t i) { return (city.places[i] - at).squaredNorm(); });
    found.resize(count);
    return found;
}

struct LightsHere {
    bool sun = true;
    int spots = 0;
};

/// One that draws the city as a host does, tile by tile, with shadows or without.
class ShadowHost {
public:
    ShadowHost(const ShadowCity& city, const LightsHere& lights, bool shadows, std::vector<Screen> screens)
        : city_(city), aspect_(cityStage("city", cityOnGround(), 1).aspect), screens_(std::move(screens)) {
        ChangeListBuilder list;
        auto next = [id = city.next]() mutable { return std::exchange(id, ObjectId{id.value + 1}); };
        const auto stand = [&](ObjectId core, const Vec3d& at, const Vec3d& towards) {
            const ObjectId place = next(), outer = next(), inner = next();
            list.create(place, typeOf<Transform>());
            list.set(place, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(at));
            list.set(place, typeOf<Transform>(), fieldId<&Transform::rotation>,
                     toValue(Quatd(Quatd::FromTwoVectors(-Vec3d::UnitZ(), towards))));
            list.create(outer, typeOf<Node>());
            list.set(outer, typeOf<Node>(), fieldId<&Node::core>, toValue(place));
            list.place(outer, kRootNode);
            list.create(inner, typeOf<Node>());
            list.set(inner, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
            list.place(inner, outer);
        };
        if (lights.sun) {
            const ObjectId sun = next();
            list.create(sun, typeOf<DirectionalLight>());
            list.set(sun, typeOf<DirectionalLight>(), fieldId<&DirectionalLight::shadows>, toValue(shadows));
            stand(sun, Vec3d::Zero(), Vec3d(-0.4, -1, -0.3));
        }
        for (int i = 0; i < lights.spots; ++i) {
            const ObjectId spot = next();
            list.create(spot, typeOf<SpotLight>());
            list.set(spot, typeOf<SpotLight>(), fieldId<&SpotLight::shadows>, toValue(shadows));
            list.set(spot, typeOf<SpotLight>(), fieldId<&SpotLight::intensity>, toValue(60.0f));
            list.set(spot, typeOf<SpotLight>(), fieldId<&SpotLight::range>, toValue(40.0f));
            // Lamps along both sides of the street.
            stand(spot, Vec3d(i % 2 ? 3 : -3, 9, 104.0 - 8 * (i / 2)), Vec3d(i % 2 ? -0.3 : 0.3, -1, -0.1));
        }
        apply(list.take(), true);
        renderer_ = orExit(Renderer::create(*surface_, {.samples = 4}));
        for (const Screen& screen : screens_)
            for (int tile = 0; tile < screen.grid.columns * screen.grid.rows; ++tile)
                tiles_.push_back({&screen, rectOf(screen, tile),
                                  std::make_unique<TilePainter>(rectOf(screen, tile), CullerKind::kAuto)});
    }

    struct FrameCost {
        double ms = 0;
        std::size_t still = 0;  ///< tiles that drew nothing
        std::size_t same = 0;   ///< tiles whose picture is the one before, to the byte
    };
    /// Moves these things by so much from where they stood, and draws all tiles.
    FrameCost frame(const std::vector<std::size_t>& moved, const Vec3d& by, const Vec3d& head) {
        ChangeListBuilder list;
        for (const std::size_t i : moved)
            list.set(city_.transforms[i], typeOf<Transform>(), fieldId<&Transform::translation>,
                     toValue(Vec3d(city_.places[i] + by)));
        const ChangeList edit = list.take();
        User user;
        user.position += head;
        FrameCost cost;
        const double start = processorMs();
        if (!moved.empty()) apply(edit, false);
        renderer_->beginFrame();
        scene_.beginFrame();
        for (Tile& tile : tiles_) {
            const ScreenCamera camera = screenCamera(*tile.screen, user, Eye::kCenter, cityView(kAt));
            const PaintedTile painted =
                orExit(tile.painter->paint(scene_, *renderer_, camera, queue_, [&](const DrawList& drawn) {
                    for (const DrawItem& item : drawn.opaque) seen_.insert(item.node);
                    return renderer_->draw(aspect_, drawn, camera, tile.rect);
                }));
            cost.still += painted.again;
            tile.now = painted.picture;
        }
        cost.ms = processorMs() - start;
        for (Tile& tile : tiles_) {
            cost.same += tile.before && (tile.now == tile.before || *tile.now == *tile.before);
            tile.before = tile.now;
        }
        return cost;
    }
    /// The city's things of which the last lists drew something, without the houses and the ground.
    [[nodiscard]] std::vector<std::size_t> seen() const {
        std::vector<std::size_t> things;
        for (std::size_t i = 0; i + 1 < city_.places.size(); ++i)
            if (i % 21 != 0 && seen_.contains(ObjectId{city_.transforms[i].value + 2})) things.push_back(i);
        return things;
    }
    [[nodiscard]] std::size_t tiles() const { return tiles_.size(); }

private:
    struct Tile {
        const Screen* screen;
        PixelRect rect;
        std::unique_ptr<TilePainter> painter;
        std::shared_ptr<const Picture> now = nullptr, before = nullptr;
    };
    static PixelRect rectOf(const Screen& screen, int tile) {
        const int width = screen.grid.tileWidthPx, height = screen.grid.tileHeightPx;
        return {tile % screen.grid.columns * width, tile / screen.grid.columns * height, width, height};
    }
    void apply(const ChangeList& list, bool anything) {
        static_cast<void>(orExit(aspect_.apply(list).map([] { return 0; })));
        scene_.update(aspect_, anything ? nullptr : &list);
    }

    const ShadowCity& city_;
    Aspect aspect_;
    std::vector<Screen> screens_;
    std::unique_ptr<Surface> surface_ = orExit(makeSurface("osmesa"));
    std::unique_ptr<Renderer> renderer_;
    RenderScene scene_;
    ProcessorQueue queue_;
    std::vector<Tile> tiles_;
    std::set<ObjectId> seen_;
};

struct ShadowCase {
    std::string name;
    LightsHere lights;
    std::vector<std::size_t> moved;
    bool inTurn = false;  ///< not all of `moved` at once, but one after the other
    bool headMoves = false;
    std::vector<Screen> screens = {benchScreen()};
    double atMost = 0;
};

void shadowRow(SceneTable& table, const ShadowCity& city, const ShadowCase& row, int frames) {
    ShadowHost with(city, row.lights, true, row.screens), without(city, row.lights, false, row.screens);
    std::vector<double> ours, theirs;
    std::size_t still = 0, same = 0, stillWithout = 0;
    constexpr int kWarm = 4;
    for (int i = -kWarm; i < frames; ++i) {
        const double turn = 0.2 * i;
        const Vec3d by = 0.4 * Vec3d(std::cos(turn), 0, std::sin(turn));
        const Vec3d head = row.headMoves ? Vec3d(0.3 * std::sin(0.1 * turn), 0.02 * std::sin(turn), 0) : Vec3d::Zero();
        const auto now = static_cast<std::size_t>(std::max(i, 0)) * row.moved.size() / static_cast<std::size_t>(frames);
        const std::vector<std::size_t> moved = row.inTurn ? std::vector{row.moved[now]} : row.moved;
        const auto one = with.frame(moved, by, head), other = without.frame(moved, by, head);
        if (i < 0) continue;
        ours.push_back(one.ms);
        theirs.push_back(other.ms);
        still += one.still;
        same += one.same;
        stillWithout += other.still;
    }
    table.add(
        {.operation = row.name,
         .peer = "without shadows",
         .ours = medianOf(ours),
         .theirs = medianOf(theirs),
         .unit = "ms",
         .atMost = row.atMost,
         .remark = fmt::format("processor time of all tiles; of {} tiles a frame {:.2f} drew nothing ({:.2f} "
                               "were the same), {:.2f} without shadows; the worst frame {:.0f} ms",
                               with.tiles(), static_cast<double>(still) / frames, static_cast<double>(same) / frames,
                               static_cast<double>(stillWithout) / frames, *std::ranges::max_element(ours))});
}

/// To the right of the bench's own, at a right angle.
Screen sideScreen() {
    Screen screen = benchScreen();
    screen.name = "side";
    screen.lowerLeft = {1.6, 0.6, 0};
    screen.lowerRight = {1.6, 0.6, 3.2};
    screen.upperLeft = {1.6, 2.4, 0};
    return screen;
}

}  // namespace

void shadowRows(SceneTable& table, int frames) {
    table.begin("shadows in the city: 12,097 things, tiles of 960x540, 4 samples");
    const ShadowCity city = makeShadowCity();
    const Vec3d left(-2, 1, 98);
    const std::vector<std::size_t> one = nearestTo(city, Vec3d(-2, 0.5, 104), 1), across = nearestTo(city, left, 1);
    const std::vector<std::size_t> many = nearestTo(city, left, 200);
    const std::vector<std::size_t> behind = nearestTo(city, Vec3d(30, 1, 190), 1);
    ShadowHost looks(city, {}, false, {benchScreen()});
    static_cast<void>(looks.frame({}, Vec3d::Zero(), Vec3d::Zero()));
    std::vector<std::size_t> seen = looks.seen();
    std::shuffle(seen.begin(), seen.end(), std::mt19937(3));
    seen.resize(12);
    shadowRow(table, city,
              {.name = "a sun, one seen thing moves, 12 in turn",
               .lights = {},
               .moved = seen,
               .inTurn = true,
               .atMost = 1.15},
              frames);
    shadowRow(table, city, {.name = "a sun, one thing moves two metres away", .lights = {}, .moved = one}, frames);
    shadowRow(table, city, {.name = "a sun, one thing moves where tiles meet", .lights = {}, .moved = across}, frames);
    shadowRow(table, city, {.name = "a sun, one thing moves that nobody sees", .lights = {}, .moved = behind}, frames);
    shadowRow(table, city, {.name = "a sun, 200 things move", .lights = {}, .moved = many}, frames);
    shadowRow(table, city, {.name = "eight spots, one thing moves", .lights = {.sun = false, .spots = 8}, .moved = one},
              frames);
    shadowRow(table, city,
              {.name = "a sun, a head moves before two screens",
               .lights = {},
               .moved = {},
               .headMoves = true,
               .screens = {benchScreen(), sideScreen()}},
              frames);
}

}  // namespace tessera::bench
