/// Hunts for what rays lose where they leave out empty space: fields, transfer functions and views at the edges of what
/// is empty. Each picture is drawn by two renderers; the other one looks everywhere.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <random>

#include "tests/unit/draw/VolumeStage.h"

namespace tessera {
namespace {

class EmptySpace : public RendererTest {
protected:
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    std::int64_t upTo(std::int64_t n) { return std::uniform_int_distribution<std::int64_t>(0, n - 1)(random_); }
    bool oneOf(std::int64_t n) { return upTo(n) == 0; }
    Vec3d anywhere(double size) { return {between(-size, size), between(-size, size), between(-size, size)}; }
    Quatd anyTurn() { return Quatd(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1)).normalized(); }

    /// Of 0 to 1, by voxel. A brick is eight cells wide: much is on its rims.
    std::vector<double> someField(std::int64_t nx, std::int64_t ny, std::int64_t nz) {
        const std::array<std::int64_t, 3> sizes{nx, ny, nz};
        const std::int64_t kind = upTo(8);
        const double low = oneOf(2) ? 0 : between(0, 0.3), radius = between(1, 20), thick = between(0.3, 1.2);
        std::array<std::int64_t, 3> special{};
        for (std::size_t axis = 0; axis < 3; ++axis)
            special[axis] =
                oneOf(2) ? upTo(sizes[axis])
                         : std::clamp<std::int64_t>(8 * upTo(sizes[axis] / 8 + 1) + upTo(3) - 1, 0, sizes[axis] - 1);
        const Vec3d middle = 0.5 * Vec3d(double(nx), double(ny), double(nz)) + anywhere(4), wave = anywhere(1.5);
        std::vector<double> field;
        for (std::int64_t z = 0; z < nz; ++z)
            for (std::int64_t y = 0; y < ny; ++y)
                for (std::int64_t x = 0; x < nx; ++x) {
                    const Vec3d at(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
                    const bool isSpecial = x == special[0] && y == special[1] && z == special[2];
                    switch (kind) {
                        case 0:
                            field.push_back(low);
                            break;  // even
                        case 1:
                            field.push_back(isSpecial ? 1 : low);
                            break;  // one voxel
                        case 2:
                            field.push_back(isSpecial ? 0 : 1 - low);
                            break;  // one hole
                        case 3:
                            field.push_back(std::abs((at - middle).norm() - radius) < thick ? 1 : low);
                            break;  // a shell
                        case 4:
                            field.push_back(z == special[2] ? 1 : low);
                            break;  // a sheet
                        case 5:
                            field.push_back(oneOf(300) ? between(0, 1) : low);
                            break;  // grains
                        case 6:
                            field.push_back(0.5 + 0.5 * std::sin(wave.dot(at)));
                            break;  // waves
                        default:
                            field.push_back((x / 8 + y / 8 + z / 8) % 2 == 0
                                                ? between(0, 0.02)
                                                : between(0, 1));  // noise in every other brick
                    }
                }
        return field;
    }

    /// Mostly of one hard step, or of a needle, or open at one end or both.
    std::vector<std::uint8_t> someTransfer() {
        const std::int64_t kind = upTo(8);
        const auto stops = static_cast<std::size_t>(kind == 6 ? 1 : 2 + upTo(oneOf(2) ? 255 : 6));
        std::vector<std::uint8_t> transfer(4 * stops);
        for (std::uint8_t& byte : transfer) byte = static_cast<std::uint8_t>(upTo(256));
        const auto at = static_cast<std::size_t>(upTo(static_cast<std::int64_t>(stops)));
        for (std::size_t i = 0; i < stops; ++i) {
            std::uint8_t& opacity = transfer[4 * i + 3];
            const std::uint8_t some = std::max<std::uint8_t>(opacity, 1);
            if (kind == 0) opacity = i < at ? 0 : 255;
            if (kind == 1) opacity = i > at ? 0 : some;
            if (kind == 2) opacity = i == at ? some : 0;
            if (kind == 3) opacity = i == 0 || i + 1 == stops ? some : 0;
            if (kind == 4) opacity = i == at ? 0 : some;
            if (kind == 5) opacity = oneOf(3) ? 1 : 0;
        }
        return kind == 7 && oneOf(3) ? std::vector<std::uint8_t>() : transfer;
    }

    Volume someSpace() {
        Volume v;
        const auto size = [&] {
            return oneOf(4) ? 2 + upTo(3) : oneOf(3) ? 8 * (1 + upTo(5)) + upTo(3) : 2 + upTo(50);
        };
        v.sizeX = size();
        v.sizeY = size();
        v.sizeZ = size();
        v.format = upTo(4);
        std::vector<double> values = someField(v.sizeX, v.sizeY, v.sizeZ);
        const std::array<double, 4> least{0, 0, -32768, oneOf(2) ? -1e4 : -1},
            most{255, 65535, 32767, oneOf(2) ? 1e4 : 1};
        const auto format = static_cast<std::size_t>(v.format);
        const double range = most[format] - least[format];
        for (double& value : values)
            value =
                v.format == Volume::kFloat ? least[format] + range * value : std::floor(least[format] + range * value);
        v.voxels = v.format == Volume::kUint8    ? numbersFrom<std::uint8_t>(values)
                   : v.format == Volume::kUint16 ? numbersFrom<std::uint16_t>(values)
                   : v.format == Volume::kInt16  ? numbersFrom<std::int16_t>(values)
                                                 : numbersFrom<float>(values);
        // A window of all, of some, of a sliver; or one that a voxel's value ends.
        const double met = values[static_cast<std::size_t>(upTo(static_cast<std::int64_t>(values.size())))];
        v.low = oneOf(3) ? least[format] : oneOf(3) ? met : least[format] + range * between(-0.3, 0.9);
        v.high = v.low + range * (oneOf(4) ? std::pow(10, between(-6, -1)) : oneOf(3) ? 1 : between(0.1, 1.2));
        const std::vector<std::uint8_t> transfer = someTransfer();
        if (!transfer.empty()) v.transfer = Blob::of(std::span<const std::uint8_t>(transfer));
        v.surfaceValue = v.low + between(0, 1) * (v.high - v.low);
        v.mode = oneOf(8) ? Volume::kSurface : oneOf(3) ? Volume::kMaximum : Volume::kCloud;
        v.shaded = oneOf(2);
        v.spacing = Vec3d(between(0.2, 1), between(0.2, 1), between(0.2, 1)) * 4 /
                    static_cast<double>(std::max({v.sizeX, v.sizeY, v.sizeZ}));
        v.origin = -0.5 * v.spacing.cwiseProduct(Vec3d(double(v.sizeX - 1), double(v.sizeY - 1), double(v.sizeZ - 1)));
        v.thickness = std::pow(10, between(-3, 1));
        v.step = oneOf(4) ? 4 : oneOf(4) ? 0.05 : between(0.1, 2);
        std::vector<double> planes;
        for (std::int64_t i = oneOf(2) ? 0 : upTo(6); i > 0; --i) {
            // Along the voxels, between two bricks; or any.
            const Vec3d n = oneOf(3) ? Vec3d(Vec3d::Unit(upTo(3)) * (oneOf(2) ? 1 : -1)) : anywhere(1);
            const Vec3d through =
                v.origin + v.spacing.cwiseProduct(Vec3d(double(8 * upTo(4)), double(8 * upTo(4)), double(8 * upTo(4))));
            planes.insert(planes.end(), {n.x(), n.y(), n.z(), oneOf(2) ? n.dot(through) : between(-0.3, 1) * n.norm()});
        }
        if (!planes.empty()) v.clipPlanes = Blob::of(std::span<const double>(planes));
        return v;
    }

    std::mt19937 random_;
};

/// Of one format each. Most of the time is the compiling of programs, nearly one for each picture where nobody has
/// drawn them before: so there are few, and TESSERA_SEED has others.
class EmptySpaceOfFormat : public EmptySpace, public testing::WithParamInterface<std::int64_t> {};

TEST_P(EmptySpaceOfFormat, ThatIsLeftOutChangesNoBit) {
    std::size_t shown = 0, pictures = 0;
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        const auto otherSurface = makeSurface("osmesa").value();
        const auto other = Renderer::create(*otherSurface, {.samples = samples, .leaveOutEmpty = false}).value();
        for (const unsigned seed : volumeSeeds(samples == 1 ? 160 : 40)) {
            random_.seed(seed + 77'000);
            const Volume v = someSpace();
            if (v.format != GetParam()) continue;
            TestScene scene;
            scene.setEnvironment(Vec3f(0.4f, 0.5f, 0.3f), Vec3f(0.1f, 0.1f, 0.2f), Vec3f(0.05f, 0.1f, 0.02f));
            scene.addDirectionalLight(anywhere(1).normalized(), Vec3f::Ones(), 0.8f);
            // As it lies, so that rays run along its axes; or stretched, sheared, mirrored; tiny or huge, with its eye
            // as far away.
            const bool straight = oneOf(3);
            const double large = oneOf(4) ? std::pow(10, between(-4, 4)) : 1;
            const Vec3d scale =
                straight ? Vec3d::Ones()
                         : Vec3d(between(0.2, 3), between(0.2, 3), oneOf(3) ? between(-2, -0.2) : between(0.2, 3));
            const Vec3d shift = straight ? Vec3d::Zero() : anywhere(0.5);
            const Quatd inner = straight ? Quatd::Identity() : anyTurn(),
                        outer = straight ? Quatd::Identity() : anyTurn();
            scene.addNode(scene.addCore(v),
                          scene.addTransform(Vec3d::Zero(), inner, Vec3d::Ones(),
                                             scene.addTransform(large * shift, outer, large * scale)));
            const ObjectId red = scene.add(unlit(Vec3f(0.7f, 0.2f, 0.4f)));
            const auto solid = [&] {
                return scene.add(makeSheet(large * between(0.5, 4), large * between(0.5, 4)), red);
            };
            if (oneOf(3)) scene.place(solid(), large * anywhere(0.8), anyTurn());
            const Aspect aspect = scene.take();
            View view;
            view.worldUnitsPerMetre = large;
            // In it, at its rim, before it, far away; straight ahead through its middle.
            const double rim = v.origin.z() + v.spacing.z() * static_cast<double>(v.sizeZ - 1);
            const double away = oneOf(4)   ? between(0.05, 0.6)
                                : oneOf(3) ? rim
                                : oneOf(4) ? between(3, 100)
                                           : between(0.6, 3);
            const Vec3d eye = oneOf(2) ? Vec3d(0, 0, away) : Vec3d(between(-0.6, 0.6), between(-0.6, 0.6), away);
            const int side = oneOf(2) ? 65 : 64;
            const ScreenCamera camera = cameraOf(side, side, eye, oneOf(4) ? 0.3 : 3.2, view);
            const DrawList list = listOf(aspect, camera);
            const auto some = renderer_->draw(aspect, list, camera, whole(camera)),
                       all = other->draw(aspect, list, camera, whole(camera));
            ASSERT_TRUE(some && all);
            const auto [at, from] = std::ranges::mismatch(some->rgb, all->rgb);
            if (at != some->rgb.end()) {
                const auto byte = at - some->rgb.begin();
                ADD_FAILURE() << "pixel " << byte / 3 % side << ' ' << byte / 3 / side << " is " << int{*at} << ", not "
                              << int{*from} << ", " << samples << " samples, mode " << v.mode
                              << "\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=*EmptySpace*";
            }
            ++pictures;
            const std::uint8_t* first = all->rgb.data();
            bool content = false;
            for (std::size_t i = 3; i < all->rgb.size() && !content; ++i)
                content = std::abs(all->rgb[i] - first[i % 3]) > 12;
            shown += content;
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(3 * shown, pictures) << "pictures of nothing prove nothing";
    }
}

INSTANTIATE_TEST_SUITE_P(Of, EmptySpaceOfFormat, testing::Values<std::int64_t>(0, 2));
INSTANTIATE_TEST_SUITE_P(MoreOf, EmptySpaceOfFormat, testing::Values<std::int64_t>(1, 3));

}  // namespace
}  // namespace tessera
