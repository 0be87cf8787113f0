/// Scalar fields: each pixel beside rays that are followed in double, straight from what Volume.h says.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>

#include "client/draw/VolumeTextures.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/VolumeShapes.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

/// Its seeds: those named, or one that TESSERA_SEED says.
std::vector<unsigned> volumeSeeds(unsigned count) {
    if (const char* one = std::getenv("TESSERA_SEED")) return {static_cast<unsigned>(std::atoi(one))};
    std::vector<unsigned> seeds(count);
    for (unsigned i = 0; i < count; ++i) seeds[i] = i + 1;
    return seeds;
}

class FieldDice {
public:
    explicit FieldDice(unsigned seed) : random_(seed) {}
    double any(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }
    Vec3d vector(double size) { return {any(-size, size), any(-size, size), any(-size, size)}; }
    Quatd turn() { return Quatd(any(-1, 1), any(-1, 1), any(-1, 1), any(-1, 1)).normalized(); }

private:
    std::mt19937 random_;
};

template <typename Number>
Blob numbersFrom(const std::vector<double>& values) {
    std::vector<Number> numbers;
    for (const double value : values) numbers.push_back(static_cast<Number>(value));
    return Blob::of(std::span<const Number>(numbers));
}

Volume someVolume(FieldDice& dice) {
    Volume v;
    v.sizeX = 2 + dice.below(6);
    v.sizeY = 2 + dice.below(6);
    v.sizeZ = 2 + dice.below(6);
    v.format = dice.below(4);
    const double least = v.format == Volume::kInt16 ? -32768 : v.format == Volume::kFloat ? -3 : 0;
    const double most = v.format == Volume::kUint8 ? 255 : v.format == Volume::kUint16 ? 65535 : v.format == Volume::kInt16 ? 32767 : 5;
    std::vector<double> values;
    for (std::int64_t i = 0; i < v.sizeX * v.sizeY * v.sizeZ; ++i) values.push_back(v.format == Volume::kFloat ? dice.any(least, most) : std::round(dice.any(least, most)));
    v.voxels = v.format == Volume::kUint8 ? numbersFrom<std::uint8_t>(values) : v.format == Volume::kUint16 ? numbersFrom<std::uint16_t>(values) : v.format == Volume::kInt16 ? numbersFrom<std::int16_t>(values) : numbersFrom<float>(values);
    v.spacing = Vec3d(dice.any(0.1, 0.5), dice.any(0.1, 0.5), dice.any(0.1, 0.5));
    v.origin = -0.5 * v.spacing.cwiseProduct(Vec3d(static_cast<double>(v.sizeX - 1), static_cast<double>(v.sizeY - 1), static_cast<double>(v.sizeZ - 1))) + dice.vector(0.2);
    v.low = least + dice.any(-0.2, 0.4) * (most - least);
    v.high = v.low + dice.any(0.3, 1) * (most - least);
    std::vector<std::uint8_t> transfer;
    for (std::uint32_t i = 0, stops = dice.below(6); i < 4 * stops; ++i) transfer.push_back(static_cast<std::uint8_t>(dice.below(4) == 0 ? 255 * dice.below(2) : dice.below(256)));
    v.transfer = transfer.empty() ? Blob() : Blob::of(std::span<const std::uint8_t>(transfer));
    v.thickness = dice.any(0.1, 2);
    v.step = 0.05;
    v.shaded = false;
    std::vector<double> planes;
    for (std::uint32_t i = 0, count = dice.below(3); i < count; ++i) {
        const Vec3d n = dice.vector(2);
        planes.insert(planes.end(), {n.x(), n.y(), n.z(), dice.any(-0.3, 0.8) * n.norm()});
    }
    if (!planes.empty()) v.clipPlanes = Blob::of(std::span<const double>(planes));
    return v;
}

/// What the header says is seen at a place, of 1.
struct SeenThere {
    std::array<double, 3> color{};
    double opacity = 0;
};

SeenThere byTransfer(const Volume& v, double value) {
    const std::vector<std::uint8_t> grey = {0, 0, 0, 0, 255, 255, 255, 255};
    std::span<const std::uint8_t> stops = v.transfer.empty() ? std::span<const std::uint8_t>(grey) : v.transfer.as<std::uint8_t>();
    const std::size_t count = stops.size() / 4;
    const double at = std::clamp((value - v.low) / (v.high - v.low), 0.0, 1.0) * static_cast<double>(count - 1);
    const std::size_t first = std::min(static_cast<std::size_t>(at), count - 1), next = std::min(first + 1, count - 1);
    const double f = at - static_cast<double>(first);
    const auto channel = [&](std::size_t c) { return (stops[4 * first + c] * (1 - f) + stops[4 * next + c] * f) / 255; };
    return {{channel(0), channel(1), channel(2)}, channel(3)};
}

double valueAt(const Volume& v, const Vec3d& place) { return gridOf(v).linearAt((place - v.origin).cwiseQuotient(v.spacing)); }

/// Of a ray in the node's coordinates, t in lengths of them.
struct FieldRay {
    Vec3d from, along;  ///< of length 1
    double begin = 0, end = 0;

    FieldRay(const Volume& v, const Vec3d& eye, const Vec3d& direction, double nearest, double solid) : from(eye), along(direction), begin(nearest), end(solid) {
        const Vec3d upper = v.origin + v.spacing.cwiseProduct(Vec3d(static_cast<double>(v.sizeX - 1), static_cast<double>(v.sizeY - 1), static_cast<double>(v.sizeZ - 1)));
        for (int axis = 0; axis < 3; ++axis) {
            cut(Vec3d::Unit(axis), upper[axis]);
            cut(-Vec3d::Unit(axis), -v.origin[axis]);
        }
        const std::span<const double> planes = v.clipPlanes.as<double>();
        for (std::size_t i = 0; i < planes.size(); i += 4) cut({planes[i], planes[i + 1], planes[i + 2]}, planes[i + 3]);
    }
    void cut(const Vec3d& n, double d) {
        const double towards = n.dot(along), before = d - n.dot(from);
        if (towards > 0) end = std::min(end, before / towards);
        if (towards < 0) begin = std::max(begin, before / towards);
        if (towards == 0 && before < 0) end = -1;
    }
};

/// Pieces that end at multiples of `step`, each looked at `times` times.
SeenThere followed(const Volume& v, const FieldRay& ray, double step, int times) {
    SeenThere seen;
    double clear = 1, greatest = -1e300;
    for (double at = ray.begin; at < ray.end;) {
        const double next = std::min(ray.end, (std::floor(at / step + 1e-9) + 1) * step), piece = (next - at) / times;
        for (int i = 0; i < times; ++i) {
            const double value = valueAt(v, ray.from + (at + (i + 0.5) * piece) * ray.along);
            greatest = std::max(greatest, value);
            const SeenThere here = byTransfer(v, value);
            const double a = 1 - std::pow(1 - std::min(here.opacity, 1 - std::ldexp(1, -16)), piece / v.thickness);
            for (std::size_t c = 0; c < 3; ++c) seen.color[c] += clear * a * here.color[c];
            clear *= 1 - a;
        }
        at = next;
    }
    seen.opacity = 1 - clear;
    if (v.mode != Volume::kMaximum || greatest == -1e300) return seen;
    seen = byTransfer(v, greatest);
    for (double& c : seen.color) c *= seen.opacity;
    return seen;
}

class VolumeTest : public RendererTest {
protected:
    struct Stage {
        Aspect aspect;
        ScreenCamera camera;
        Affine3d world_T_node;
        Rgb background;
        double solidZ = -1e9;  ///< a sheet right across the view
    };
    /// Stretched below a turn: sheared, mirrored now and then.
    static Stage someStage(FieldDice& dice, const Volume& v) {
        Stage stage;
        TestScene scene;
        const Vec3f behind(0.2f, 0.5f, 0.1f);
        scene.setDark(behind);
        stage.background = expectedOf(behind);
        const Quatd outer = dice.turn(), inner = dice.turn();
        const Vec3d scale(dice.any(0.6, 1.6), dice.any(0.6, 1.6), dice.below(3) == 0 ? -dice.any(0.6, 1.2) : dice.any(0.6, 1.6)), shift = dice.vector(0.3);
        scene.addNode(scene.addCore(v), scene.addTransform(Vec3d::Zero(), inner, Vec3d::Ones(), scene.addTransform(shift, outer, scale)));
        stage.world_T_node = Eigen::Translation3d(shift) * outer * Eigen::Scaling(scale) * inner;
        if (dice.below(2) == 0) {
            stage.solidZ = dice.any(-1, 0.2);  // before every eye
            const Vec3f color(0.7f, 0.2f, 0.4f);
            scene.place(scene.add(makeSheet(60, 60), scene.add(unlit(color))), {0, 0, stage.solidZ});
            stage.background = expectedOf(color);
        }
        stage.aspect = scene.take();
        stage.camera = cameraOf(kSidePx, kSidePx, {dice.any(-0.5, 0.5), dice.any(-0.5, 0.5), dice.below(2) == 0 ? dice.any(0.3, 0.8) : 2.4});
        return stage;
    }
    /// Through a pixel's middle, in the world; the eye is where it begins.
    static Vec3d throughPixel(const ScreenCamera& camera, double x, double y) {
        const Vec4d clip(2 * x / kSidePx - 1, 1 - 2 * y / kSidePx, 0, 1);
        const Vec4d eye = camera.clip_T_eye.inverse() * clip;
        return camera.eye_T_world.inverse() * Vec3d(eye.head<3>() / eye.w());
    }
    /// The part of the ray in the volume, before what is solid.
    static FieldRay rayOf(const Stage& stage, const Volume& v, double x, double y) {
        const Vec3d place = throughPixel(stage.camera, x, y), eye = stage.camera.eyeWorld;
        const Affine3d node_T_world = stage.world_T_node.inverse();
        const Vec3d from = node_T_world * eye, all = node_T_world * place - from;
        const double lengthPerWay = all.norm(), solid = (stage.solidZ - eye.z()) / (place.z() - eye.z());
        // As of all things, nothing of it is seen before the near plane.
        const double nearest = ClipRange().nearMetres / -(stage.camera.eye_T_world * place).z();
        return FieldRay(v, from, all / lengthPerWay, nearest * lengthPerWay, solid > 0 ? solid * lengthPerWay : 1e9);
    }
    static int over(double color, double opacity, int background) { return static_cast<int>(std::lround(std::clamp(255 * color + (1 - opacity) * background, 0.0, 255.0))); }
};

// Of many steps each ray is what the integral is; what is left of the difference is known, as both can be had in double.
TEST_F(VolumeTest, CloudsAndMaximaAreWhatRaysInDoubleSee) {
    int covered = 0;
    double mostOff = 0;
    for (const unsigned seed : volumeSeeds(30)) {
        FieldDice dice(seed);
        Volume v = someVolume(dice);
        v.mode = seed % 3 == 0 ? Volume::kMaximum : Volume::kCloud;
        const Stage stage = someStage(dice, v);
        const Picture picture = draw(stage.aspect, stage.camera);
        const double step = v.step * v.spacing.minCoeff();
        for (int y = 0; y < kSidePx; y += 3)
            for (int x = 0; x < kSidePx; x += 3) {
                const FieldRay ray = rayOf(stage, v, x + 0.5, y + 0.5);
                // At the rim of the box a ray's rounding decides whether it meets it.
                if (std::abs(ray.end - ray.begin) < 1e-3) continue;
                const SeenThere rule = followed(v, ray, step, 1), truth = followed(v, ray, step, 8);
                covered += truth.opacity > 0.02;
                const Rgb is = pixel(picture, x, y);
                const std::array<int, 3> channels{is.r, is.g, is.b}, behind{stage.background.r, stage.background.g, stage.background.b};
                for (std::size_t c = 0; c < 3; ++c) {
                    const int wanted = over(truth.color[c], truth.opacity, behind[c]);
                    const double ruleOff = std::abs(over(rule.color[c], rule.opacity, behind[c]) - wanted);
                    mostOff = std::max<double>(mostOff, std::abs(channels[c] - wanted));
                    // What is behind is one off at most (ExpectedColor.h); colour, opacity, their product and what is wanted are rounded once each.
                    ASSERT_LE(std::abs(channels[c] - wanted), 3 + ruleOff)
                        << "at " << x << ' ' << y << " channel " << c << ": is " << is << ", wanted " << wanted << " of opacity " << truth.opacity << ", mode " << v.mode << " format " << v.format
                        << "\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=VolumeTest.CloudsAndMaxima*";
                }
            }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(covered, 1500);
    }
    RecordProperty("mostOff", static_cast<int>(mostOff));
}

// Planes in each other, cut where they meet: each is blended once at every pixel. Pieces are sorted by their middles, as all that is transparent: nearly
// always from the farthest on.
TEST_F(VolumeTest, SlicesAreBlendedOnceEachFromTheFarthestOn) {
    int layered = 0, inOrder = 0;
    for (const unsigned seed : volumeSeeds(20)) {
        FieldDice dice(seed);
        Volume v = someVolume(dice);
        v.mode = Volume::kSlices;
        const Vec3d middle = v.origin + 0.5 * v.spacing.cwiseProduct(Vec3d(static_cast<double>(v.sizeX - 1), static_cast<double>(v.sizeY - 1), static_cast<double>(v.sizeZ - 1)));
        const Quatd turned = seed % 2 == 0 ? Quatd::Identity() : dice.turn();
        std::vector<double> planes;
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3d n = turned * Vec3d::Unit(axis) * dice.any(0.1, 9);
            planes.insert(planes.end(), {n.x(), n.y(), n.z(), n.dot(middle)});
        }
        v.slices = Blob::of(std::span<const double>(planes));
        const Stage stage = someStage(dice, v);
        const Picture picture = draw(stage.aspect, stage.camera);
        for (int y = 0; y < kSidePx; y += 3)
            for (int x = 0; x < kSidePx; x += 3) {
                const FieldRay ray = rayOf(stage, v, x + 0.5, y + 0.5);
                std::vector<std::pair<double, SeenThere>> layers;
                bool atRim = std::abs(ray.end - ray.begin) < 0.02;
                for (std::size_t i = 0; i < planes.size(); i += 4) {
                    const Vec3d n(planes[i], planes[i + 1], planes[i + 2]);
                    const double t = (planes[i + 3] - n.dot(ray.from)) / n.dot(ray.along);
                    atRim = atRim || std::abs(t - ray.begin) < 0.03 || std::abs(t - ray.end) < 0.03 || std::abs(n.normalized().dot(ray.along)) < 0.05;
                    for (const auto& other : layers) atRim = atRim || std::abs(other.first - t) < 0.03;
                    if (t > ray.begin && t < ray.end) layers.emplace_back(t, byTransfer(v, valueAt(v, ray.from + t * ray.along)));
                }
                if (atRim) continue;
                const Rgb is = pixel(picture, x, y);
                const std::array<int, 3> channels{is.r, is.g, is.b}, behind{stage.background.r, stage.background.g, stage.background.b};
                // What is behind is one off at most; of each layer colour and opacity are rounded, and their blend is one off at most.
                const double tolerance = 1 + 2 * static_cast<double>(layers.size());
                const auto asBlended = [&] {
                    for (std::size_t c = 0; c < 3; ++c) {
                        double wanted = behind[c];
                        for (const auto& [t, seen] : layers) wanted = 255 * seen.opacity * seen.color[c] + (1 - seen.opacity) * wanted;
                        if (std::abs(channels[c] - wanted) > tolerance) return false;
                    }
                    return true;
                };
                const auto farther = [](const auto& one, const auto& other) { return one.first > other.first; };
                std::ranges::sort(layers, farther);
                const bool sorted = asBlended();
                layered += layers.size() > 1;
                inOrder += layers.size() > 1 && sorted;
                bool inAny = sorted;
                while (!inAny && std::next_permutation(layers.begin(), layers.end(), farther)) inAny = asBlended();
                ASSERT_TRUE(inAny) << "at " << x << ' ' << y << ": " << is << " of " << layers.size() << " layers\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=VolumeTest.Slices*";
            }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(layered, 200);
        EXPECT_GT(inOrder, layered * 9 / 10);
    }
}

// Every mode, lit or not, of one sample and of four, with something solid within.
TEST_F(VolumeTest, TilesAreCropsOfTheOnePicture) {
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (const unsigned seed : volumeSeeds(12)) {
            FieldDice dice(seed);
            Volume v = someVolume(dice);
            v.step = 0.5;
            v.shaded = seed % 2 == 0;
            v.mode = seed % 4 == 3 ? Volume::kSlices : seed % 4 == 2 ? Volume::kMaximum : Volume::kCloud;
            const std::vector<double> planes = {1, 0, 0, v.origin.x() + 0.1, 0, 1, 0.5, 0};
            v.slices = Blob::of(std::span<const double>(planes));
            TestScene scene;
            scene.setEnvironment(Vec3f(0.4f, 0.5f, 0.6f), Vec3f(0.2f, 0.1f, 0.1f), Vec3f(0.1f, 0.1f, 0.2f));
            scene.addDirectionalLight(Vec3d(-1, -1, -1), Vec3f::Ones(), 1);
            scene.addNode(scene.addCore(v), scene.addTransform(dice.vector(0.2), dice.turn(), Vec3d(0.8, -1.1, 0.9)));
            scene.place(scene.add(makeSheet(0.4, 5), scene.add(unlit(Vec3f(0.9f, 0.1f, 0.1f)))), dice.vector(0.2), dice.turn());
            const Aspect aspect = scene.take();
            const ScreenCamera camera = cameraOf(200, 130, {dice.any(-1, 1), dice.any(-1, 1), dice.any(0.3, 2.4)});
            RenderScene drawn;
            drawn.update(aspect, nullptr);
            RenderAction all(CullerKind::kNone), culled(CullerKind::kMasked);
            const auto one = renderer_->draw(aspect, all.run(drawn, camera, whole(camera), nullptr), camera, whole(camera));
            ASSERT_TRUE(one);
            for (const PixelRect& tile : {PixelRect{0, 0, 70, 61}, PixelRect{70, 0, 130, 61}, PixelRect{0, 61, 70, 69}, PixelRect{70, 61, 130, 69}}) {
                const auto part = renderer_->draw(aspect, culled.run(drawn, camera, tile, nullptr), camera, tile);
                ASSERT_TRUE(part);
                for (int y = 0; y < tile.height; ++y) {
                    const int row = 130 - tile.y - tile.height + y;
                    const auto* from = &one->rgb[3 * static_cast<std::size_t>(200 * row + tile.x)];
                    ASSERT_TRUE(std::equal(from, from + 3 * tile.width, &part->rgb[3 * static_cast<std::size_t>(tile.width * y)]))
                        << "row " << y << " of the tile at " << tile.x << ' ' << tile.y << ", samples " << samples << "\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=VolumeTest.Tiles*";
                }
            }
        }
    }
}

// Where a pixel's samples see different depths, none of them is as bright or dark as no ray through the pixel.
TEST_F(VolumeTest, EdgesOfSolidThingsInCloudsHaveNoFringe) {
    restart({.samples = 4});
    Volume v;
    v.sizeX = v.sizeY = v.sizeZ = 2;
    v.voxels = numbersFrom<std::uint8_t>(std::vector<double>(8, 255));
    v.origin = Vec3d(-1, -1, -1);
    v.spacing = Vec3d(2, 2, 1);
    const std::vector<std::uint8_t> black = {0, 0, 0, 128};
    v.transfer = Blob::of(std::span<const std::uint8_t>(black));
    v.thickness = 0.5;
    v.shaded = false;
    int between = 0;
    for (const unsigned seed : volumeSeeds(6)) {
        FieldDice dice(seed);
        TestScene scene;
        scene.setDark(Vec3f(1, 1, 1));
        scene.addNode(scene.addCore(v));
        // White before white, half way into the dark.
        const double depth = dice.any(-0.7, -0.3);
        scene.place(scene.add(makeSheet(0.8, 3), scene.add(unlit(Vec3f(1, 1, 1)))), {0, 0, depth}, Quatd(Eigen::AngleAxisd(dice.any(0, 3), Vec3d::UnitZ())));
        const Aspect aspect = scene.take();
        const Picture picture = draw(aspect, cameraOf(kSidePx, kSidePx));
        // Of the two depths, each beside the other: what a ray sees.
        int darkest = 255, brightest = 0;
        std::map<int, int> shades;
        for (int y = 24; y < 40; ++y)
            for (int x = 20; x < 44; ++x) ++shades[pixel(picture, x, y).r];
        for (const auto& [shade, count] : shades) darkest = std::min(darkest, shade), brightest = std::max(brightest, shade);
        const double white = expectedOf(Vec3f(1, 1, 1)).r;
        const auto left = [&](double thick) { return white * std::pow(1 - 128.0 / 255, thick / 0.5); };
        // Rays in this part go through at most so much more than straight ahead.
        const double slant = std::hypot(1.0, 0.6 / 2.4, 0.4 / 2.4);
        EXPECT_GE(darkest, left(slant) - 4) << seed;
        EXPECT_LE(brightest, left(-depth) + 4) << seed;
        const double low = left(1.0), high = left(-depth);
        for (const auto& [shade, count] : shades) between += shade > low + 0.3 * (high - low) && shade < low + 0.7 * (high - low) ? count : 0;
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(between, 10);  // edges are smooth
    }
}

TEST_F(VolumeTest, OfEditedVoxelsTheirLayersAloneAreUploaded) {
    Volume v;
    v.sizeX = v.sizeY = 16;
    v.sizeZ = 32;
    v.voxels = numbersFrom<std::uint8_t>(std::vector<double>(16 * 16 * 32, 0));
    v.origin = Vec3d(-0.75, -0.75, -1.55);
    v.spacing = Vec3d(0.1, 0.1, 0.1);
    v.thickness = 0.1;
    v.shaded = false;
    TestScene scene;
    scene.setDark();
    const ObjectId core = scene.addCore(v);
    scene.addNode(core);
    Aspect aspect = scene.take();
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    EXPECT_EQ(center(draw(aspect, camera)).r, 0);
    const std::uint64_t before = renderer_->uploadedTextureBytes();
    const std::vector<std::byte> bright(16 * 16, std::byte{255});
    const auto edited = v.voxels.withRange(10 * 16 * 16, bright);
    ASSERT_TRUE(edited);
    ChangeListBuilder edit;
    edit.set(core, typeOf<Volume>(), fieldId<&Volume::voxels>, toValue(*edited));
    ASSERT_TRUE(aspect.apply(edit.take()));
    EXPECT_GT(center(draw(aspect, camera)).r, 100);
    EXPECT_EQ(renderer_->uploadedTextureBytes() - before, 16u * 16u);
}

// Any planes, such as touch, meet or repeat each other too: closed, and nothing of it beyond any of them.
TEST(VolumeShapes, BoxesThatAreCutAreClosed) {
    int left = 0;
    for (const unsigned seed : volumeSeeds(400)) {
        FieldDice dice(seed);
        Volume v = someVolume(dice);
        v.mode = Volume::kCloud;
        std::vector<double> planes;
        const Box box = boxOf(v);
        for (std::uint32_t i = 0, count = dice.below(9); i < count; ++i) {
            Vec3d n = dice.below(3) == 0 ? Vec3d(Vec3d::Unit(static_cast<int>(dice.below(3)))) : dice.below(2) == 0 ? Vec3d(1, dice.below(2) ? 1 : -1, dice.below(3) ? 0 : 1) : dice.vector(1);
            // Through a corner, the middle, or anywhere.
            const Vec3d through = dice.below(3) == 0 ? Vec3d(box.upper.x(), box.lower.y(), box.upper.z()) : dice.below(2) == 0 ? box.center() : Vec3d(box.center() + 0.4 * dice.any(-1, 1) * box.size());
            n *= std::pow(10, dice.any(-9, 9));
            planes.insert(planes.end(), {n.x(), n.y(), n.z(), n.dot(through)});
            if (dice.below(4) == 0) planes.insert(planes.end(), {n.x(), n.y(), n.z(), n.dot(through)});
        }
        v.clipPlanes = planes.empty() ? Blob() : Blob::of(std::span<const double>(planes));
        const MeshData mesh = shapeOnScreens(v);
        left += !mesh.indices.empty();
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (std::size_t i = 0; i < mesh.indices.size(); ++i) ++edges[{mesh.indices[i], mesh.indices[i % 3 == 2 ? i - 2 : i + 1]}];
        for (const auto& [edge, count] : edges) {
            const auto back = edges.find({edge.second, edge.first});
            // Where planes leave a face alone, there and back along its diagonals.
            ASSERT_TRUE(back != edges.end() && back->second == count)
                << "edge " << edge.first << ' ' << edge.second << "\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=VolumeShapes.Boxes*";
        }
        const double rounding = 1e-6 * (box.size().norm() + box.lower.norm());
        for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3) {
            const Vec3d p(mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]);
            for (std::size_t k = 0; k < planes.size(); k += 4) {
                const Vec3d n(planes[k], planes[k + 1], planes[k + 2]);
                ASSERT_LE((n.dot(p) - planes[k + 3]) / n.norm(), rounding) << "TESSERA_SEED=" << seed;
            }
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(left, 200);
    }
}

}  // namespace
}  // namespace tessera
