/// Where images lie on a surface: placed, repeated and filtered as their material says.
#include <algorithm>
#include <functional>
#include <numbers>
#include <random>

#include "tests/unit/draw/MaterialStage.h"

namespace tessera {
namespace {

/// A picture that shows an image by its own light, on a sheet that fills it: u to the right, v down, 0 to 1.
class PlacedImageTest : public MaterialTest {
protected:
    static constexpr int kImagePx = 8;
    static Rgba colorOf(int x, int y) {
        return {static_cast<std::uint8_t>(25 * x + 20), static_cast<std::uint8_t>(25 * y + 20),
                static_cast<std::uint8_t>((x * 5 + y * 3) % 8 * 25), 255};
    }
    static Image numbered() { return imageOf(kImagePx, colorOf); }
    static MeshData sheetOf(const std::function<Vec2f(Vec2f)>& texcoord, bool second) {
        MeshData sheet = makeSheet(3.2, 3.2);
        std::vector<float> set;
        for (std::size_t i = 0; i < sheet.texcoords.size(); i += 2) {
            const Vec2f uv = texcoord({sheet.texcoords[i], sheet.texcoords[i + 1]});
            set.insert(set.end(), {uv.x(), uv.y()});
        }
        (second ? sheet.texcoords1 : sheet.texcoords) = set;
        return sheet;
    }
    Picture shown(const Image& image, const MeshData& sheet) {
        TestScene scene;
        scene.setDark();
        Material material = of({0, 0, 0});
        material.emissive = Vec3f::Ones();
        material.emissiveImage = scene.add(image);
        scene.place(scene.add(sheet, scene.add(material)), {0, 0, -0.0001});
        return draw(scene);
    }
    /// Each pixel beside the image's own nearest pixel at `place` of its texture coordinates; but for pixels whose
    /// place lies within a twentieth of the image's pixel from another one.
    static void expectPlaced(const Picture& picture, const std::function<Vec2d(Vec2d)>& place) {
        int compared = 0;
        for (int y = 1; y < kSidePx - 1; ++y)
            for (int x = 1; x < kSidePx - 1; ++x) {
                const Vec2d at = kImagePx * place({(x + 0.5) / kSidePx, (y + 0.5) / kSidePx});
                const Vec2d within = at - at.array().floor().matrix();
                if (within.minCoeff() < 0.05 || within.maxCoeff() > 0.95) continue;
                const auto wrapped = [](double v) {
                    const int i = static_cast<int>(std::floor(v)) % kImagePx;
                    return i < 0 ? i + kImagePx : i;
                };
                const Rgba color = colorOf(wrapped(at.x()), wrapped(at.y()));
                const Vec3d linear(linearOf(color[0]), linearOf(color[1]), linearOf(color[2]));
                ++compared;
                const Rgb is = pixel(picture, x, y), should = expectedOf(linear.cast<float>());
                // Colours are kept with 9 bits of the brightest one.
                ASSERT_LE(std::max({std::abs(is.r - should.r), std::abs(is.g - should.g), std::abs(is.b - should.b)}),
                          3)
                    << x << ' ' << y << ": " << is << " instead of " << should;
            }
        EXPECT_GT(compared, 1000);
    }
};

TEST_F(PlacedImageTest, ScaledThenTurnedThenMoved) {
    std::mt19937 random(20);
    std::uniform_real_distribution<float> any(-3, 3);
    for (int i = 0; i < 12; ++i) {
        Image image = numbered();
        image.magnification = Image::kNearest;
        image.minification = Image::kNearestAlone;
        image.offset = {any(random), any(random)};
        image.scale = {any(random), any(random)};
        image.rotation = i == 0 ? 0 : any(random);
        const Picture picture = shown(image, sheetOf([](Vec2f uv) { return uv; }, false));
        // KHR_texture_transform: T · R · S. Counter-clockwise where v points down.
        const Eigen::Rotation2Dd turn(-static_cast<double>(image.rotation));
        expectPlaced(picture, [&](const Vec2d& uv) {
            return Vec2d(turn * uv.cwiseProduct(image.scale.cast<double>()) + image.offset.cast<double>());
        });
        if (HasFatalFailure()) return;
    }
}

TEST_F(PlacedImageTest, ByTheSecondTextureCoordinatesWhereItAsks) {
    Image image = numbered();
    image.magnification = Image::kNearest;
    image.texcoordSet = 1;
    MeshData sheet = sheetOf([](const Vec2f& uv) { return Vec2f(uv.y(), 2 * uv.x()); }, true);
    expectPlaced(shown(image, sheet), [](const Vec2d& uv) { return Vec2d(uv.y(), 2 * uv.x()); });
    // A mesh without a second set shows one place of the image.
    sheet.texcoords1.clear();
    const Picture one = shown(image, sheet);
    EXPECT_EQ(pixel(one, 5, 5).r, pixel(one, 60, 40).r);
}

TEST_F(PlacedImageTest, RepeatsClampsAndMirrors) {
    const auto wrap = [](std::int64_t how, double v) {
        if (how == Image::kClamp) return std::clamp(v, 0.06, 0.94);
        if (how == Image::kRepeat) return v;
        const double two = v - 2 * std::floor(v / 2);
        return two < 1 ? two : 2 - two;
    };
    for (const std::int64_t u : {Image::kRepeat, Image::kClamp, Image::kMirror})
        for (const std::int64_t v : {Image::kRepeat, Image::kClamp, Image::kMirror}) {
            Image image = numbered();
            image.magnification = Image::kNearest;
            image.minification = Image::kNearestAlone;
            image.wrapU = u;
            image.wrapV = v;
            const Picture picture =
                shown(image, sheetOf([](const Vec2f& uv) { return Vec2f(3 * uv.x() - 1, 3 * uv.y() - 1.5f); }, false));
            expectPlaced(picture,
                         [&](const Vec2d& uv) { return Vec2d(wrap(u, 3 * uv.x() - 1), wrap(v, 3 * uv.y() - 1.5)); });
            if (HasFatalFailure()) return;
        }
}

TEST_F(PlacedImageTest, FiltersAsItIsTold) {
    // Two columns, black and white: linear makes a slope of them, nearest an edge.
    const Image halves = imageOf(2, [](int x, int) {
        const auto v = static_cast<std::uint8_t>(x == 0 ? 0 : 255);
        return Rgba{v, v, v, 255};
    });
    const MeshData sheet = sheetOf([](const Vec2f& uv) { return uv; }, false);
    for (const std::int64_t how : {Image::kLinear, Image::kNearest}) {
        Image image = halves;
        image.magnification = how;
        std::set<int> tones;
        const Picture picture = shown(image, sheet);
        for (int x = 20; x < 44; ++x) tones.insert(pixel(picture, x, 30).g);
        EXPECT_EQ(tones.size() > 5, how == Image::kLinear);
    }
    // A checkerboard of single pixels, made small: grey where levels are used, black and white where not.
    const Image board = imageOf(256, [](int x, int y) {
        const auto v = static_cast<std::uint8_t>((x ^ y) & 1 ? 255 : 0);
        return Rgba{v, v, v, 255};
    });
    for (const std::int64_t how : {Image::kTrilinear, Image::kNearestAlone, Image::kNearestOfNearest,
                                   Image::kLinearOfNearest, Image::kNearestOfTwo}) {
        Image image = board;
        image.minification = how;
        const Picture picture = shown(image, sheet);
        int grey = 0;
        for (int x = 8; x < 56; ++x) {
            const int tone = pixel(picture, x, 31).g;
            grey += tone > 100 && tone < 230;
        }
        EXPECT_EQ(grey > 40, how != Image::kNearestAlone) << how;
    }
}

}  // namespace
}  // namespace tessera
