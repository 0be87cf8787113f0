/// Scalar fields: each pixel beside rays that are followed in double, straight from what Volume.h says.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>

#include "client/draw/passes/UploadAhead.h"
#include "tests/unit/draw/VolumeStage.h"

namespace tessera {
namespace {

using VolumeTest = VolumeStage;

// Of many steps each ray is what the integral is; what is left of the difference is known, as both can be had in
// double.
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
        const std::array<int, 3> behind{stage.background.r, stage.background.g, stage.background.b};
        for (const auto& [x, y, ray, is] : pixelsOf(picture, stage, v, 0, 3)) {
            const SeenThere rule = followed(v, ray, step, 1), truth = followed(v, ray, step, 8);
            covered += truth.opacity > 0.02;
            for (std::size_t c = 0; c < 3; ++c) {
                const int wanted = over(truth.color[c], truth.opacity, behind[c]);
                const double ruleOff = std::abs(over(rule.color[c], rule.opacity, behind[c]) - wanted);
                mostOff = std::max<double>(mostOff, std::abs(is[c] - wanted));
                // What is behind is one off at most (ExpectedColor.h); colour, opacity, their product and what is
                // wanted are rounded once each.
                ASSERT_LE(std::abs(is[c] - wanted), 3 + ruleOff)
                    << "at " << x << ' ' << y << " channel " << c << ": is " << is[c] << ", wanted " << wanted
                    << " of opacity " << truth.opacity << ", mode " << v.mode << " format " << v.format
                    << "\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=VolumeTest.CloudsAndMaxima*";
            }
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(covered, 1500);
    }
    RecordProperty("mostOff", static_cast<int>(mostOff));
}

// Coarse steps: what each piece shows is told from what its neighbours would, and from what other pixels see.
TEST_F(VolumeTest, EachPieceOfARayIsSeenOnceWhereItsMiddleIs) {
    int covered = 0;
    for (const unsigned seed : volumeSeeds(60)) {
        FieldDice dice(seed);
        Volume v = someVolume(dice);
        v.step = dice.any(0.3, 2);
        v.mode = seed % 3 == 0 ? Volume::kMaximum : Volume::kCloud;
        const Stage stage = someStage(dice, v);
        const Picture picture = draw(stage.aspect, stage.camera);
        const double step = v.step * v.spacing.minCoeff();
        const std::array<int, 3> behind{stage.background.r, stage.background.g, stage.background.b};
        for (const auto& [x, y, ray, is] : pixelsOf(picture, stage, v, 0, 3)) {
            const auto byPieces = [&](double at) { return std::abs(at / step - std::round(at / step)); };
            // Where rounding decides whether there is a piece.
            if (byPieces(ray.begin) < 1e-3 || byPieces(ray.end) < 1e-3) continue;
            const SeenThere rule = followed(v, ray, step, 1);
            covered += rule.opacity > 0.02;
            for (std::size_t c = 0; c < 3; ++c)
                ASSERT_LE(std::abs(is[c] - over(rule.color[c], rule.opacity, behind[c])), 3)
                    << "at " << x << ' ' << y << " channel " << c << ": is " << is[c] << " of opacity " << rule.opacity
                    << ", mode " << v.mode << " format " << v.format << " step " << v.step << "\nTESSERA_SEED=" << seed
                    << " unit_draw --gtest_filter=VolumeTest.EachPiece*";
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(covered, 3000);
    }
}

// Planes in each other, cut where they meet: each is blended once at every pixel, from the farthest on.
TEST_F(VolumeTest, SlicesAreBlendedOnceEachFromTheFarthestOn) {
    int layered = 0;
    std::size_t most = 0;
    for (const unsigned seed : volumeSeeds(60)) {
        FieldDice dice(seed);
        Volume v = someVolume(dice);
        v.mode = Volume::kSlices;
        const Box box = boxOf(v);
        const Quatd turned = seed % 2 == 0 ? Quatd::Identity() : dice.turn();
        std::vector<double> planes;
        const auto add = [&](const Vec3d& normal, const Vec3d& through) {
            const Vec3d n = normal * dice.any(0.1, 9);
            planes.insert(planes.end(), {n.x(), n.y(), n.z(), n.dot(through)});
        };
        // Three through the middle; or any number anywhere, some of them beside each other.
        if (seed % 3 == 0)
            for (int axis = 0; axis < 3; ++axis) add(turned * Vec3d::Unit(axis), box.center());
        else
            for (std::uint32_t i = 0, count = 2 + dice.below(seed % 5 == 0 ? 20 : 6); i < count; ++i)
                add(dice.below(3) == 0 ? Vec3d(turned * Vec3d::UnitX()) : Vec3d(dice.vector(1)),
                    box.center() + box.size().cwiseProduct(dice.vector(0.5)));
        v.slices = Blob::of(std::span<const double>(planes));
        const Stage stage = someStage(dice, v);
        const Picture picture = draw(stage.aspect, stage.camera);
        const std::array<int, 3> behind{stage.background.r, stage.background.g, stage.background.b};
        for (const auto& [x, y, ray, is] : pixelsOf(picture, stage, v, 0, 3)) {
            std::vector<std::pair<double, SeenThere>> layers;
            bool atRim = std::abs(ray.end - ray.begin) < 0.02;
            for (std::size_t i = 0; i < planes.size(); i += 4) {
                const Vec3d n(planes[i], planes[i + 1], planes[i + 2]);
                const double t = (planes[i + 3] - n.dot(ray.from)) / n.dot(ray.along);
                atRim = atRim || std::abs(t - ray.begin) < 0.02 || std::abs(t - ray.end) < 0.02 ||
                        std::abs(n.normalized().dot(ray.along)) < 0.03;
                if (!(t > ray.begin && t < ray.end)) continue;
                for (const auto& other : layers) atRim = atRim || std::abs(other.first - t) < 1e-3;
                layers.emplace_back(t, byTransfer(v, valueAt(v, ray.from + t * ray.along)));
            }
            if (atRim) continue;
            std::ranges::sort(layers, [](const auto& one, const auto& other) { return one.first > other.first; });
            layered += layers.size() > 1;
            most = std::max(most, layers.size());
            for (std::size_t c = 0; c < 3; ++c) {
                double wanted = behind[c];
                for (const auto& [t, seen] : layers)
                    wanted = 255 * seen.opacity * seen.color[c] + (1 - seen.opacity) * wanted;
                // What is behind is one off at most; of each layer colour and opacity are rounded, and their blend is
                // one off at most.
                ASSERT_LE(std::abs(is[c] - wanted), 1 + 2 * static_cast<double>(layers.size()))
                    << "at " << x << ' ' << y << ": " << is[c] << " of " << layers.size() << " layers"
                    << "\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=VolumeTest.Slices*";
            }
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(layered, 1000);
        EXPECT_GT(most, 5u);
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
            scene.place(scene.add(makeSheet(0.4, 5), scene.add(unlit(Vec3f(0.9f, 0.1f, 0.1f)))), dice.vector(0.2),
                        dice.turn());
            const Aspect aspect = scene.take();
            const ScreenCamera camera = cameraOf(200, 130, {dice.any(-1, 1), dice.any(-1, 1), dice.any(0.3, 2.4)});
            RenderScene drawn;
            drawn.update(aspect, nullptr);
            RenderAction all(CullerKind::kNone), culled(CullerKind::kMasked);
            const auto one =
                renderer_->draw(aspect, all.run(drawn, camera, whole(camera), nullptr), camera, whole(camera));
            ASSERT_TRUE(one);
            for (const PixelRect& tile : {PixelRect{0, 0, 70, 61}, PixelRect{70, 0, 130, 61}, PixelRect{0, 61, 70, 69},
                                          PixelRect{70, 61, 130, 69}}) {
                const auto part = renderer_->draw(aspect, culled.run(drawn, camera, tile, nullptr), camera, tile);
                ASSERT_TRUE(part);
                for (int y = 0; y < tile.height; ++y) {
                    const int row = 130 - tile.y - tile.height + y;
                    const auto* from = &one->rgb[3 * static_cast<std::size_t>(200 * row + tile.x)];
                    ASSERT_TRUE(std::equal(from, from + 3 * tile.width,
                                           &part->rgb[3 * static_cast<std::size_t>(tile.width * y)]))
                        << "row " << y << " of the tile at " << tile.x << ' ' << tile.y << ", samples " << samples
                        << "\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=VolumeTest.Tiles*";
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
        scene.place(scene.add(makeSheet(0.8, 3), scene.add(unlit(Vec3f(1, 1, 1)))), {0, 0, depth},
                    Quatd(Eigen::AngleAxisd(dice.any(0, 3), Vec3d::UnitZ())));
        const Aspect aspect = scene.take();
        const Picture picture = draw(aspect, cameraOf(kSidePx, kSidePx));
        // Of the two depths, each beside the other: what a ray sees.
        int darkest = 255, brightest = 0;
        std::map<int, int> shades;
        for (int y = 24; y < 40; ++y)
            for (int x = 20; x < 44; ++x) ++shades[pixel(picture, x, y).r];
        for (const auto& [shade, count] : shades)
            darkest = std::min(darkest, shade), brightest = std::max(brightest, shade);
        const double white = expectedOf(Vec3f(1, 1, 1)).r;
        const auto left = [&](double thick) { return white * std::pow(1 - 128.0 / 255, thick / 0.5); };
        // Rays in this part go through at most so much more than straight ahead.
        const double slant = std::hypot(1.0, 0.6 / 2.4, 0.4 / 2.4);
        EXPECT_GE(darkest, left(slant) - 4) << seed;
        EXPECT_LE(brightest, left(-depth) + 4) << seed;
        const double low = left(1.0), high = left(-depth);
        for (const auto& [shade, count] : shades)
            between += shade > low + 0.3 * (high - low) && shade < low + 0.7 * (high - low) ? count : 0;
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

// A slice of layers at a time, also while pictures are drawn; then drawing uploads nothing.
TEST_F(VolumeTest, VoxelsComeAheadOfNeed) {
    for (const std::int64_t mode : {Volume::kCloud, Volume::kMaximum, Volume::kSlices}) {
        Volume v;
        v.sizeX = v.sizeY = v.sizeZ = 32;
        std::vector<double> values;
        for (int i = 0; i < 32 * 32 * 32; ++i) values.push_back((i * 7 + i / 900) % 256);
        v.voxels = numbersFrom<std::uint8_t>(values);
        v.origin = Vec3d::Constant(-0.775);
        v.spacing = Vec3d::Constant(0.05);
        const std::vector<double> planes = {0, 0, 1, 0};
        v.slices = Blob::of(std::span<const double>(planes));
        v.mode = mode;
        TestScene made;
        made.setDark();
        made.addNode(made.addCore(v));
        const Aspect aspect = made.take();
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        RenderScene scene;
        scene.update(aspect, nullptr);
        restart({.samples = 1});
        const Picture expected = draw(aspect, camera);
        for (const bool interrupted : {false, true}) {
            restart({.samples = 1});
            UploadAhead ahead;
            int steps = 0;
            for (bool more = true; more && steps < 1000; ++steps) {
                const std::uint64_t before = renderer_->uploadedTextureBytes();
                more = ahead.step(*renderer_, aspect, scene, camera.eyeWorld, 4096).value();
                EXPECT_LE(renderer_->uploadedTextureBytes() - before, 4096u);
                if (interrupted && steps == 4) {
                    EXPECT_EQ(draw(aspect, camera).rgb, expected.rgb) << "in the middle of it";
                }
            }
            EXPECT_GT(steps, interrupted ? 4 : 8);
            EXPECT_EQ(renderer_->uploadedTextureBytes(), 32u * 32 * 32);
            EXPECT_EQ(draw(aspect, camera).rgb, expected.rgb);
            EXPECT_EQ(renderer_->uploadedTextureBytes(), 32u * 32 * 32) << "all was there";
        }
    }
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
            Vec3d n = dice.below(3) == 0   ? Vec3d(Vec3d::Unit(static_cast<int>(dice.below(3))))
                      : dice.below(2) == 0 ? Vec3d(1, dice.below(2) ? 1 : -1, dice.below(3) ? 0 : 1)
                                           : dice.vector(1);
            // Through a corner, the middle, or anywhere.
            const Vec3d through = dice.below(3) == 0   ? Vec3d(box.upper.x(), box.lower.y(), box.upper.z())
                                  : dice.below(2) == 0 ? box.center()
                                                       : Vec3d(box.center() + 0.4 * dice.any(-1, 1) * box.size());
            n *= std::pow(10, dice.any(-9, 9));
            planes.insert(planes.end(), {n.x(), n.y(), n.z(), n.dot(through)});
            if (dice.below(4) == 0) planes.insert(planes.end(), {n.x(), n.y(), n.z(), n.dot(through)});
        }
        v.clipPlanes = planes.empty() ? Blob() : Blob::of(std::span<const double>(planes));
        const MeshData mesh = shapeOnScreens(v);
        left += !mesh.indices.empty();
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (std::size_t i = 0; i < mesh.indices.size(); ++i)
            ++edges[{mesh.indices[i], mesh.indices[i % 3 == 2 ? i - 2 : i + 1]}];
        for (const auto& [edge, count] : edges) {
            const auto back = edges.find({edge.second, edge.first});
            // Where planes leave a face alone, there and back along its diagonals.
            ASSERT_TRUE(back != edges.end() && back->second == count)
                << "edge " << edge.first << ' ' << edge.second << "\nTESSERA_SEED=" << seed
                << " unit_draw --gtest_filter=VolumeShapes.Boxes*";
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

// Each piece of a slice lies on one side of all slices before it; together the pieces are as large as the slice. 64 of
// them too.
TEST(VolumeShapes, SlicesAreCutByThoseBeforeThem) {
    std::size_t most = 0;
    for (const unsigned seed : volumeSeeds(60)) {
        FieldDice dice(seed);
        Volume v = someVolume(dice);
        v.mode = Volume::kSlices;
        v.clipPlanes = {};
        const Box box = boxOf(v);
        std::vector<double> planes;
        for (std::uint32_t i = 0, count = seed == 60 ? kMostVolumePlanes : 1 + dice.below(12); i < count; ++i) {
            const Vec3d n = dice.vector(1), through = box.center() + 0.3 * box.size().cwiseProduct(dice.vector(1));
            planes.insert(planes.end(), {n.x(), n.y(), n.z(), n.dot(through)});
        }
        v.slices = Blob::of(std::span<const double>(planes));
        const MeshData mesh = shapeOnScreens(v);
        const double rounding = 1e-6 * (box.size().norm() + box.lower.norm());
        std::vector<double> areas(planes.size() / 4);
        for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
            std::array<Vec3d, 3> corners;
            for (std::size_t k = 0; k < 3; ++k)
                corners[k] = Vec3f(&mesh.positions[3 * std::size_t{mesh.indices[t + k]}]).cast<double>();
            const auto slice = static_cast<std::size_t>(mesh.texcoords[2 * std::size_t{mesh.indices[t]} + 1]);
            ASSERT_LT(slice, areas.size());
            areas[slice] += 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
            for (std::size_t k = 0; k <= slice; ++k) {
                const Vec3d n = Vec3d(planes[4 * k], planes[4 * k + 1], planes[4 * k + 2]);
                double least = 1e300, greatest = -1e300;
                for (const Vec3d& corner : corners) {
                    const double off = (n.dot(corner) - planes[4 * k + 3]) / n.norm();
                    least = std::min(least, off);
                    greatest = std::max(greatest, off);
                }
                ASSERT_TRUE(least > -rounding || greatest < rounding)
                    << "slice " << slice << " goes through slice " << k << ", TESSERA_SEED=" << seed;
                if (k == slice) {
                    ASSERT_TRUE(least > -rounding && greatest < rounding) << "TESSERA_SEED=" << seed;
                }
            }
        }
        for (std::size_t k = 0; k < areas.size(); ++k) {
            Volume one = v;
            one.slices = Blob::of(std::span<const double>(planes).subspan(4 * k, 4));
            const MeshData alone = shapeOnScreens(one);
            double area = 0;
            for (std::size_t t = 0; t < alone.indices.size(); t += 3) {
                const auto corner = [&](std::size_t i) {
                    return Vec3d(Vec3f(&alone.positions[3 * std::size_t{alone.indices[t + i]}]).cast<double>());
                };
                area += 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
            }
            ASSERT_NEAR(areas[k], area, 1e-4 * (area + 1e-3)) << "slice " << k << ", TESSERA_SEED=" << seed;
        }
        most = std::max(most, mesh.indices.size() / 3);
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(most, 10'000u);
    }
}

}  // namespace
}  // namespace tessera
