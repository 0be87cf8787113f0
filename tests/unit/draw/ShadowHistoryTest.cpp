// Whatever has happened to a scene under lights with shadows: what is kept of their maps makes the picture that one
// gets who has just come, and a tile that draws nothing would draw what it shows.
#include <memory>
#include <optional>
#include <random>

#include "common/cores/Billboard.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Switch.h"
#include "tests/golden/Stage.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

constexpr int kShownWidthPx = 128, kShownHeightPx = 96;

/// Things over a floor, and random edits of them.
class ShadedHistory {
public:
    struct Lights {
        int suns = 1, spots = 1, points = 0;
    };
    ShadedHistory(unsigned seed, const Lights& lights) : random_(seed) {
        const ObjectId floor = add(geometryOf(makeSheet(18, 18), {}));
        place(floor, {0, -1, -4}, Quatd(Eigen::AngleAxisd(-0.5 * M_PI, Vec3d::UnitX())));
        for (int i = 0; i < 12; ++i) image_.push_back(static_cast<std::uint8_t>(random_() % 2 ? 255 : 0));
        holes_ = add(holedImage());
        material_ = add(Material{.roughness = 1});
        cut_ = add(Material{.roughness = 1, .baseColorImage = holes_, .alphaMode = Material::kMask});
        glass_ = add(Material{.baseColor = {1, 1, 1, 0.4f}});
        for (const ObjectId material : {ObjectId(), material_, cut_, glass_})
            for (const MeshData& mesh : {makeBox({1, 1, 1}), makeSphere(0.6, 24), makeSheet(1.5, 1.5)})
                shapes_.push_back(add(geometryOf(mesh, material)));
        for (int i = 0; i < lights.suns; ++i) {
            DirectionalLight sun;
            sun.shadows = true;
            sun.intensity = 0.6f;
            lights_.push_back(placedLight(add(sun)));
        }
        for (int i = 0; i < lights.points; ++i) {
            PointLight point;
            point.shadows = true;
            point.intensity = 15;
            point.range = i % 2 ? 0 : 16;
            lights_.push_back(placedLight(add(point)));
        }
        for (int i = 0; i < lights.spots; ++i) {
            SpotLight spot;
            spot.shadows = true;
            spot.intensity = 20;
            spot.range = i % 2 ? 14 : 0;
            lights_.push_back(placedLight(add(spot)));
        }
        for (int i = 0; i < 14; ++i) thing();
        apply(nullptr);
    }
    [[nodiscard]] const Aspect& aspect() const { return aspect_; }

    /// What has changed, as a RenderScene follows it.
    void step(RenderScene& all) {
        const std::size_t edits = random_() % 4 == 0 ? 0 : 1 + random_() % 3;
        for (std::size_t i = 0; i < edits; ++i) edit();
        apply(&all);
    }
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    bool oneIn(unsigned n) { return random_() % n == 0; }

private:
    struct Thing {
        ObjectId pose, outer, inner;
    };
    template <typename T>
    ObjectId add(const T& core) {
        const ObjectId id{next_++};
        list_.create(id, typeOf<T>());
        setAllFields(list_, id, Object::of(core));
        return id;
    }
    static Geometry geometryOf(const MeshData& mesh, ObjectId material) {
        const MeshArrays arrays = mesh.toArrays();
        Geometry geometry;
        geometry.positions = arrays.positions;
        geometry.normals = arrays.normals;
        geometry.texcoords = arrays.texcoords;
        geometry.indices = arrays.indices;
        geometry.material = material;
        return geometry;
    }
    Image holedImage() {
        std::vector<std::uint8_t> pixels;
        for (const std::uint8_t alpha : image_) pixels.insert(pixels.end(), {255, 255, 255, alpha});
        return {.pixels = Blob::of(std::span<const std::uint8_t>(pixels)), .widthPx = 4, .heightPx = 3};
    }
    template <auto kField, typename T, typename Value>
    void set(ObjectId id, const Value& value) {
        list_.set(id, typeOf<T>(), fieldId<kField>, toValue(value));
    }
    ObjectId node(ObjectId core, ObjectId parent) {
        const ObjectId id{next_++};
        list_.create(id, typeOf<Node>());
        if (core) set<&Node::core, Node>(id, core);
        list_.place(id, parent);
        return id;
    }
    ObjectId pose(const Vec3d& at, const Quatd& turn) {
        Transform transform;
        transform.translation = at;
        transform.rotation = turn;
        return add(transform);
    }
    ObjectId place(ObjectId core, const Vec3d& at, const Quatd& turn) {
        return node(core, node(pose(at, turn), kRootNode));
    }
    Vec3d anywhere() { return {between(-6, 6), between(-0.5, 3), between(-9, 1)}; }
    Vec3d aloft() { return {between(-5, 5), between(4, 7), between(-8, 0)}; }
    Quatd turned() { return Quatd(Eigen::AngleAxisd(between(0, 6), Vec3d(between(-1, 1), 1, 0.3).normalized())); }
    /// From above, more or less.
    Quatd shining() { return Quatd::FromTwoVectors(-Vec3d::UnitZ(), Vec3d(between(-1, 1), -1, between(-1, 1))); }
    ObjectId placedLight(ObjectId light) {
        const ObjectId at = pose(aloft(), shining());
        node(light, node(at, kRootNode));
        return at;
    }
    void thing() {
        Thing made{.pose = pose(anywhere(), turned()), .outer = {}, .inner = {}};
        made.outer = node(made.pose, kRootNode);
        ObjectId above = made.outer;
        if (random_() % 6 == 0) above = node(add(Billboard()), above);
        if (random_() % 6 == 0) {
            Switch choice;
            choice.choice = 0;
            switches_.push_back(add(choice));
            above = node(switches_.back(), above);
        } else if (random_() % 6 == 0) {
            levels_.push_back(node(add(DistanceLOD()), above));
            above = levels_.back();
            node(shape(), above);
        }
        made.inner = node(shape(), above);
        things_.push_back(made);
    }
    ObjectId shape() { return shapes_[random_() % shapes_.size()]; }
    void edit() {
        Thing& one = things_[random_() % things_.size()];
        switch (random_() % 14) {
            case 0:
            case 1:
            case 2:
            case 3:
                // The first ones more often than others, so that some rest and some never do.
                set<&Transform::translation, Transform>(things_[random_() % 3].pose, anywhere());
                break;
            case 4:
                set<&Transform::rotation, Transform>(one.pose, turned());
                break;
            case 5:
                thing();
                break;
            case 6:
                if (things_.size() > 6) {
                    list_.place(one.outer, {});
                    std::swap(one, things_.back());
                    things_.pop_back();
                }
                break;
            case 7:
                set<&Node::core, Node>(one.inner, shape());
                break;
            case 8:
                set<&Geometry::positions, Geometry>(shapes_[3 * (random_() % 4)],
                                                    makeBox({between(0.4, 2), 1, 1}).toArrays().positions);
                break;
            case 9:
                set<&Material::baseColor, Material>(
                    random_() % 2 ? material_ : cut_,
                    Vec4f(static_cast<float>(between(0.3, 1)), 1, 1, static_cast<float>(between(0.3, 1))));
                break;
            case 10:
                image_[random_() % image_.size()] ^= 255;
                set<&Image::pixels, Image>(holes_, holedImage().pixels);
                break;
            case 11:
                set<&Material::alphaMode, Material>(random_() % 2 ? material_ : cut_,
                                                    random_() % 2 ? Material::kMask : Material::kOpaque);
                break;
            case 12:
                if (!switches_.empty())
                    set<&Switch::choice, Switch>(switches_[random_() % switches_.size()],
                                                 random_() % 2 ? Switch::kAll : std::int64_t{7});
                if (!levels_.empty())
                    set<&Node::levels, Node>(levels_[random_() % levels_.size()],
                                             static_cast<std::int64_t>(random_() % 2 + 256 * (random_() % 2)));
                break;
            default:
                if (lights_.empty() || random_() % 3 > 0) break;
                if (const ObjectId light = lights_[random_() % lights_.size()]; random_() % 2)
                    set<&Transform::rotation, Transform>(light, shining());
                else
                    set<&Transform::translation, Transform>(light, aloft());
        }
    }
    void apply(RenderScene* all) {
        const ChangeList list = list_.take();
        const auto applied = aspect_.apply(list);
        ASSERT_TRUE(applied) << applied.error().message;
        if (all) all->update(aspect_, &list);
    }

    std::mt19937 random_;
    ChangeListBuilder list_;
    Aspect aspect_;
    std::uint64_t next_ = 2;
    std::vector<std::uint8_t> image_;
    ObjectId holes_, material_, cut_, glass_;
    std::vector<ObjectId> shapes_, lights_, switches_, levels_;
    std::vector<Thing> things_;
};

/// A tile, or an eye, of one of a host's screens.
struct Shown {
    explicit Shown(unsigned ofUser) : user(ofUser) {}
    unsigned user;
    RenderAction action{CullerKind::kAuto};
    std::optional<DrawList> list;
    ScreenCamera camera{};
    SceneVersion version;
    Picture picture;
};

class ShadowHistory : public RendererTest, public testing::WithParamInterface<unsigned> {
protected:
    /// The right half of the screen is a second tile of the first user's.
    static PixelRect rectOf(std::size_t tile) {
        return {.x = tile == 1 ? kShownWidthPx / 2 : 0,
                .y = 0,
                .width = tile < 2 ? kShownWidthPx / 2 : kShownWidthPx,
                .height = kShownHeightPx};
    }
};

TEST_P(ShadowHistory, IsThePictureOfOneWhoHasJustCome) {
    const unsigned seed = GetParam();
    // A sun and spots; points among them, or alone; a studio's sun, as there is no other light.
    const ShadedHistory::Lights lights =
        seed >= 6   ? ShadedHistory::Lights{.suns = 0, .spots = 0}
        : seed >= 4 ? ShadedHistory::Lights{.suns = seed % 2 ? 0 : 1, .spots = seed % 2 ? 0 : 1, .points = 2}
                    : ShadedHistory::Lights{.spots = seed % 2 ? 8 : 1};
    ShadedHistory history(seed, lights);
    RendererOptions little{.samples = 1};
    if (seed % 3 == 0) little.shadowBudgetBytes = 1;  // room for nothing that is not needed at once
    restart(little);
    test::Stage other(1);
    RenderScene all;
    all.update(history.aspect(), nullptr);
    std::vector<std::unique_ptr<Shown>> tiles;
    for (const unsigned user : {0u, 0u, 1u}) tiles.push_back(std::make_unique<Shown>(user));
    std::array<Vec3d, 2> heads = {Vec3d(0, 0, 2.4), Vec3d(0.4, 0.2, 2)};
    // The first user leaps between these: maps of before are found again.
    const std::array<Vec3d, 3> places = {Vec3d(0, 1, 2), Vec3d(7, 1.5, 3), Vec3d(-3, 2, 9)};
    std::size_t place = 0;
    int still = 0, changed = 0;
    for (int step = 0; step < 40; ++step) {
        if (step > 0) history.step(all);
        if (history.oneIn(4)) heads[0].x() = history.between(-0.5, 0.5);
        if (history.oneIn(5)) place = static_cast<std::size_t>(history.between(0, 2.99));
        RenderScene fresh;
        fresh.update(history.aspect(), nullptr);
        renderer_->beginFrame();
        all.beginFrame();
        for (std::size_t t = 0; t < tiles.size(); ++t) {
            Shown& tile = *tiles[t];
            View view;
            view.position = tile.user == 0 ? places[place] : places[0];
            view.orientation = Quatd(Eigen::AngleAxisd(-0.25, Vec3d::UnitX()));
            if (seed >= 6) view.studio = Studio{.middle = Vec3d(0, -1, -4), .reach = 6};
            ScreenCamera camera = cameraOf(kShownWidthPx, kShownHeightPx, heads[tile.user], 3.2, view);
            camera.user = tile.user;
            const PixelRect rect = rectOf(t);
            DrawList list = tile.action.run(all, camera, rect, nullptr);
            const bool same = tile.list && tile.version.contents == all.version().contents &&
                              drawAlike(camera, tile.camera) && drawAlike(list, *tile.list);
            // Tiles that are still are drawn by who has just come alone. He draws all maps: in each other step.
            if (!same) tile.picture = renderer_->draw(history.aspect(), list, camera, rect).value();
            if (step % 2 == 0) {
                RenderAction now(CullerKind::kNone);
                const Picture picture =
                    other.renderer->draw(history.aspect(), now.run(fresh, camera, rect, nullptr), camera, rect).value();
                ASSERT_EQ(test::differingPixels(tile.picture, picture), 0u)
                    << "seed " << seed << ", step " << step << ", tile " << t << (same ? ", which was still" : "");
            }
            same ? ++still : ++changed;
            tile.list = std::move(list);
            tile.camera = camera;
            tile.version = all.version();
        }
    }
    EXPECT_GT(still, 5);
    EXPECT_GT(changed, 40);
}

INSTANTIATE_TEST_SUITE_P(Seeds, ShadowHistory, testing::Range(0u, 2u));
INSTANTIATE_TEST_SUITE_P(MoreSeeds, ShadowHistory, testing::Range(2u, 8u));

}  // namespace
}  // namespace tessera
