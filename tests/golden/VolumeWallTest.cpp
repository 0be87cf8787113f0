// Volumes of every mode on shipped walls that are no plane, or of two eyes: each screen's parts are crops of its one
// picture, byte for byte.
#include <cmath>
#include <string>

#include "common/codec/WallCodec.h"
#include "tests/golden/Stage.h"
#include "tests/golden/TestScene.h"

namespace tessera::test {
namespace {

/// All around who stands in the middle of a room of `size`, on the floor too: clouds, lit or not, maxima, slices and
/// surfaces, most of them cut.
Aspect roomOfVolumes(double size, const Vec3d& head) {
    constexpr std::int64_t kSide = 20;
    std::vector<std::uint8_t> values;
    for (std::int64_t z = 0; z < kSide; ++z)
        for (std::int64_t y = 0; y < kSide; ++y)
            for (std::int64_t x = 0; x < kSide; ++x) {
                const Vec3d at = 0.35 * Vec3d(double(x), double(y), double(z));
                const double wave = std::sin(at.x()) * std::cos(at.y()) + std::sin(at.y()) * std::cos(at.z()) +
                                    std::sin(at.z()) * std::cos(at.x());
                values.push_back(static_cast<std::uint8_t>(std::clamp(127 + 110 * wave, 0.0, 255.0)));
            }
    Volume v;
    v.voxels = Blob::of(std::span<const std::uint8_t>(values));
    v.sizeX = v.sizeY = v.sizeZ = kSide;
    v.origin = Vec3d::Constant(-0.5);
    v.spacing = Vec3d::Constant(1.0 / (kSide - 1));
    const std::vector<std::uint8_t> transfer = {0,   0,  0,   0,   60, 20,  160, 0,   200, 60,
                                                120, 90, 255, 200, 60, 230, 255, 250, 230, 255};
    v.transfer = Blob::of(std::span<const std::uint8_t>(transfer));
    v.thickness = 0.3;
    const std::vector<double> slices = {1, 0.2, 0, 0.05, 0, 1, 0.3, -0.1, -0.2, 0.1, 1, 0},
                              clip = {1, 1, 1, 0.4, -1, 0.5, 0, 0.45};
    v.slices = Blob::of(std::span<const double>(slices));
    TestScene scene;
    scene.setEnvironment(Vec3f(0.4f, 0.45f, 0.5f), Vec3f(0.2f, 0.2f, 0.2f), Vec3f(0.15f, 0.12f, 0.1f));
    scene.addDirectionalLight({0.4, -0.8, -0.5}, {1, 0.9f, 0.8f}, 0.8f);
    scene.addPointLight(head + Vec3d(0.3, 0.5, 0), {1, 0.8f, 0.6f}, 2);
    for (int i = 0; i < 30; ++i) {
        v.mode = i % 5 == 4 ? Volume::kCloud : i % 5;
        v.shaded = i % 5 == 4;
        v.clipPlanes = i % 3 == 0 ? Blob() : Blob::of(std::span<const double>(clip));
        const double a = 0.62 * i, reach = size * (0.35 + 0.25 * std::fmod(0.618 * i, 1.0));
        const Vec3d at =
            head + Vec3d(reach * std::cos(a), size * (std::fmod(0.7548 * i, 1.0) - 0.75), reach * std::sin(a));
        const Quatd turned(Eigen::AngleAxisd(i, Vec3d(1, 2, 0.5).normalized()));
        scene.addNode(scene.addCore(v),
                      scene.addTransform(at, turned, 0.32 * size * Vec3d(1, i % 4 == 0 ? -1.2 : 1, 0.9)));
    }
    return scene.take();
}

class VolumeWalls : public testing::TestWithParam<const char*> {};

TEST_P(VolumeWalls, HaveNoSeams) {
    const Wall wall = loadWall(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/" + GetParam() + ".wall").value();
    const User& user = wall.users.front();
    const Aspect aspect = roomOfVolumes(2.4, user.position);
    RenderScene scene;
    scene.update(aspect, nullptr);
    Stage whole(4), parts(4);
    std::size_t pictures = 0, shown = 0;
    for (Screen screen : wall.screens) {
        // A tenth of the pixels: the planes are those of the wall.
        screen.grid.tileWidthPx /= 10;
        screen.grid.tileHeightPx /= 10;
        for (const Eye eye : {Eye::kLeft, Eye::kRight}) {
            const ScreenCamera camera = screenCamera(screen, user, eye, {});
            const int width = camera.pixels.width, height = camera.pixels.height, x = width / 2 - 7, y = height / 2 + 5;
            const Picture one = drawPart(whole, aspect, scene, CullerKind::kNone, camera,
                                         {.x = 0, .y = 0, .width = width, .height = height});
            shown += lookOf(one).spread > 8;
            for (const PixelRect& part : {PixelRect{0, 0, x, y}, PixelRect{x, 0, width - x, y},
                                          PixelRect{0, y, x, height - y}, PixelRect{x, y, width - x, height - y}})
                EXPECT_EQ(differingPixels(drawPart(parts, aspect, scene, CullerKind::kFrustum, camera, part),
                                          cropOf(one, part)),
                          0u)
                    << screen.name << " at " << part.x << ' ' << part.y;
            ++pictures;
        }
    }
    EXPECT_GE(2 * shown, pictures) << "pictures without content prove nothing";
}

INSTANTIATE_TEST_SUITE_P(Shipped, VolumeWalls, testing::Values("curved-9x2", "cave4-stereo", "5-sided"),
                         [](const testing::TestParamInfo<const char*>& wall) {
                             std::string name = wall.param;
                             std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
                             return name;
                         });

}  // namespace
}  // namespace tessera::test
