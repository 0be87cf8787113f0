// Glass in glass: triangles are sorted together. The truth is the same glass in triangles so small that their order is
// right in every pixel.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <set>

#include "client/draw/passes/Renderer.h"
#include "client/render/order/RenderAction.h"
#include "client/render/order/TransparentOrder.h"
#include "tests/golden/TestScene.h"
#include "tests/support/surface/PooledSurface.h"

namespace tessera::test {
namespace {

/// Each triangle in four, so often.
MeshData divided(MeshData mesh, int times) {
    for (; times > 0; --times) {
        MeshData finer;
        const auto add = [&](const Vec3d& p, const Vec3d& n) {
            for (int i = 0; i < 3; ++i) finer.positions.push_back(static_cast<float>(p[i]));
            for (int i = 0; i < 3; ++i) finer.normals.push_back(static_cast<float>(n[i]));
            finer.indices.push_back(static_cast<std::uint32_t>(finer.indices.size()));
        };
        for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
            Vec3d p[6], n[6];
            for (std::size_t i = 0; i < 3; ++i) {
                const std::size_t at = 3 * std::size_t{mesh.indices[t + i]};
                p[i] = {mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]};
                n[i] = {mesh.normals[at], mesh.normals[at + 1], mesh.normals[at + 2]};
            }
            for (std::size_t i = 0; i < 3; ++i) {
                p[3 + i] = 0.5 * (p[i] + p[(i + 1) % 3]);
                n[3 + i] = 0.5 * (n[i] + n[(i + 1) % 3]);
            }
            for (const std::size_t i : {0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5}) add(p[i], n[i]);
        }
        mesh = finer;
    }
    return mesh;
}

/// Balls, rings and panes of glass in each other, seen from both sides, some inside others.
Aspect makeGlass(unsigned seed, int times) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    TestScene scene;
    scene.setEnvironment(Vec3f::Constant(0.7f), Vec3f::Constant(0.5f), Vec3f(0.1f, 0.1f, 0.15f));
    const MeshData shapes[] = {makeSphere(0.5, 16), makeTorus(0.5, 0.2, 16, 10), makeBox({0.7, 0.7, 0.7}),
                               makeSphere(0.3, 12)};
    for (int i = 0; i < 7; ++i) {
        Material glass;
        glass.baseColor = {static_cast<float>(0.5 + 0.5 * u(random)), static_cast<float>(0.5 + 0.5 * u(random)),
                           static_cast<float>(0.5 + 0.5 * u(random)), static_cast<float>(0.5 + 0.2 * u(random))};
        glass.roughness = 1;
        glass.doubleSided = i % 2;
        scene.place(scene.add(divided(shapes[i % 4], times), scene.add(glass)),
                    {0.7 * u(random), 0.4 * u(random), -0.5 + 0.5 * u(random)},
                    Quatd(u(random), u(random), u(random), u(random)).normalized());
    }
    scene.addDirectionalLight({0.4, -1, -0.5}, Vec3f::Ones(), 1);
    return scene.take();
}

/// Mean difference of the channels, in steps of 255.
double apart(const Picture& a, const Picture& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i)
        sum += std::abs(static_cast<double>(a.rgb[i]) - static_cast<double>(b.rgb[i]));
    return sum / static_cast<double>(a.rgb.size());
}

class Glass : public testing::TestWithParam<unsigned> {
protected:
    static constexpr PixelRect kRect{.x = 0, .y = 0, .width = 320, .height = 200};
    DrawList listOf(const Aspect& aspect) {
        RenderScene all;
        all.update(aspect, nullptr);
        return RenderAction(CullerKind::kNone).run(all, camera_, kRect, nullptr);
    }
    Picture draw(const Aspect& aspect, const DrawList& list) {
        auto picture = renderer_->draw(aspect, list, camera_, kRect);
        EXPECT_TRUE(picture);
        return *picture;
    }
    ScreenCamera camera_ = test::cameraOf(320, 200, {0.1, 0.05, 1.5});
    std::unique_ptr<Surface> surface_ = test::pooledSurface();
    std::unique_ptr<Renderer> renderer_ = Renderer::create(*surface_, {.samples = 1}).value();
};

TEST_P(Glass, InGlassIsNearTheTruthWhereWholeThingsAreNot) {
    const Aspect coarse = makeGlass(GetParam(), 0);
    const Aspect fine = makeGlass(GetParam(), 3);
    const DrawList sorted = listOf(coarse);
    // As it was: whole things, by the middles of their boxes.
    DrawList whole = sorted;
    whole.transparent.clear();
    std::set<ObjectId> known;
    RenderScene all;
    all.update(coarse, nullptr);
    for (DrawItem item : RenderAction(CullerKind::kFrustum).run(all, camera_, kRect, nullptr).transparent) {
        item.sortedCount = 0;
        if (known.insert(item.node).second) whole.transparent.push_back(item);
    }
    ASSERT_EQ(whole.transparent.size(), 7u);
    const auto depth = [&](const DrawItem& item) { return (camera_.eye_T_world * item.box.center()).z(); };
    std::sort(whole.transparent.begin(), whole.transparent.end(),
              [&](const DrawItem& a, const DrawItem& b) { return depth(a) < depth(b); });
    const Picture truth = draw(fine, listOf(fine));
    const double byTriangles = apart(draw(coarse, sorted), truth), byThings = apart(draw(coarse, whole), truth);
    EXPECT_LT(byTriangles, 0.5 * byThings) << "seed " << GetParam();
    EXPECT_GT(byThings, 0.5) << "seed " << GetParam() << ": a scene in which the order hardly matters";
    RecordProperty("byTriangles", std::to_string(byTriangles));
    RecordProperty("byThings", std::to_string(byThings));
    std::printf("seed %u: by triangles %.3f, by things %.3f of 255\n", GetParam(), byTriangles, byThings);
}

/// What lies in one pixel: its colour times its alpha, in steps of 255; its alpha; how far before the eye.
struct Layer {
    Vec3d color = Vec3d::Zero();
    double alpha = 0, depth = 0;
};

/// Of each item such triangles together as surely share no pixel.
class Layers {
public:
    using Draw = std::function<Picture(const DrawList&)>;
    Layers(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera, const Draw& draw)
        : width_(camera.pixels.width), height_(camera.pixels.height), at_(static_cast<std::size_t>(width_ * height_)) {
        DrawList part = list;
        part.transparent.clear();
        const Picture nothing[] = {over(0, part, draw), over(1000, part, draw)};
        std::set<ObjectId> known;
        for (DrawItem item : list.transparent) {
            if (!known.insert(item.node).second) continue;
            std::vector<Corners> left = trianglesOf(*aspect.get<Geometry>(item.geometry), item, camera);
            while (!left.empty()) {
                std::vector<Corners> now, later;
                for (const Corners& t : left)
                    (std::any_of(now.begin(), now.end(), [&](const Corners& o) { return o.near(t); }) ? later : now)
                        .push_back(t);
                part.sortedTriangles.clear();
                for (const Corners& t : now) part.sortedTriangles.push_back(t.number);
                item.sortedFrom = 0;
                item.sortedCount = static_cast<std::uint32_t>(now.size());
                part.transparent = {item};
                const Picture pictures[] = {over(0, part, draw), over(1000, part, draw)};
                for (const Corners& t : now) addPixels(t, pictures, nothing);
                left = later;
            }
        }
    }
    /// `mix`: of a pixel's layers, the nearest first.
    template <typename Mix>
    Picture picture(const Picture& background, const Mix& mix) {
        Picture result = background;
        for (std::size_t i = 0; i < at_.size(); ++i) {
            std::sort(at_[i].begin(), at_[i].end(), [](const Layer& a, const Layer& b) { return a.depth < b.depth; });
            const Vec3d behind(background.rgb[3 * i], background.rgb[3 * i + 1], background.rgb[3 * i + 2]);
            const Vec3d c = at_[i].empty() ? behind : mix(at_[i], behind);
            for (int k = 0; k < 3; ++k)
                result.rgb[3 * i + static_cast<std::size_t>(k)] =
                    static_cast<std::uint8_t>(std::lround(std::clamp(c[k], 0.0, 255.0)));
        }
        return result;
    }

private:
    struct Corners {
        std::uint32_t number = 0;
        Vec3d eye[3];
        int left = 0, right = 0, bottom = 0, top = 0;
        [[nodiscard]] bool near(const Corners& o) const {
            return left <= o.right && o.left <= right && bottom <= o.top && o.bottom <= top;
        }
    };
    static Picture over(float radiance, DrawList list, const Draw& draw) {
        list.environment.background = Vec3f::Constant(radiance);
        return draw(list);
    }
    std::vector<Corners> trianglesOf(const Geometry& mesh, const DrawItem& item, const ScreenCamera& camera) {
        fromPixel_ = camera.clip_T_eye.inverse();
        const auto p = mesh.positions.as<float>();
        const auto indices = mesh.indices.as<std::uint32_t>();
        std::vector<Corners> all;
        for (std::size_t t = 0; t < indices.size(); t += 3) {
            Corners c{
                .number = static_cast<std::uint32_t>(t / 3), .left = width_, .right = 0, .bottom = height_, .top = 0};
            for (std::size_t i = 0; i < 3; ++i) {
                const std::size_t at = 3 * std::size_t{indices[t + i]};
                c.eye[i] = camera.eye_T_world * (item.world_T_item * Vec3d(p[at], p[at + 1], p[at + 2]));
                const Vec4d clip = camera.clip_T_eye * c.eye[i].homogeneous();
                const double x = (clip.x() / clip.w() + 1) * 0.5 * width_,
                             y = (clip.y() / clip.w() + 1) * 0.5 * height_;
                c.left = std::min(c.left, static_cast<int>(std::floor(x - 0.01)));
                c.right = std::max(c.right, static_cast<int>(std::ceil(x + 0.01)));
                c.bottom = std::min(c.bottom, static_cast<int>(std::floor(y - 0.01)));
                c.top = std::max(c.top, static_cast<int>(std::ceil(y + 0.01)));
            }
            all.push_back(c);
        }
        return all;
    }
    void addPixels(const Corners& t, const Picture (&drawn)[2], const Picture (&nothing)[2]) {
        const Vec3d normal = (t.eye[1] - t.eye[0]).cross(t.eye[2] - t.eye[0]);
        for (int y = std::max(t.bottom, 0); y < std::min(t.top, height_); ++y)
            for (int x = std::max(t.left, 0); x < std::min(t.right, width_); ++x) {
                const auto pixel = static_cast<std::size_t>((height_ - 1 - y) * width_ + x);
                const auto sum = [&](const Picture& p) {
                    return double(p.rgb[3 * pixel]) + p.rgb[3 * pixel + 1] + p.rgb[3 * pixel + 2];
                };
                Layer layer;
                layer.alpha = 1 - (sum(drawn[1]) - sum(drawn[0])) / (sum(nothing[1]) - sum(nothing[0]));
                if (layer.alpha < 0.02) continue;
                for (int k = 0; k < 3; ++k) layer.color[k] = drawn[0].rgb[3 * pixel + static_cast<std::size_t>(k)];
                const Vec4d far = fromPixel_ * Vec4d((x + 0.5) / width_ * 2 - 1, (y + 0.5) / height_ * 2 - 1, 0.5, 1);
                const Vec3d away = far.head<3>() / far.w();
                layer.depth = -away.z() * (normal.dot(t.eye[0]) / normal.dot(away));
                at_[pixel].push_back(layer);
            }
    }

    int width_, height_;
    Mat4d fromPixel_;
    std::vector<std::vector<Layer>> at_;
};

/// Weighted, blended order-independent transparency (McGuire and Bavoil 2013, "Weighted blended order-independent
/// transparency", equations 7 to 9; Journal of Computer Graphics Techniques 2/2), the other way to be the same on every
/// tile: computed from the renderer's own layers, with each of the paper's weights at three scales of depth.
TEST_P(Glass, SortedByTrianglesIsNearerTheTruthThanWeighted) {
    const Aspect coarse = makeGlass(GetParam(), 0), fine = makeGlass(GetParam(), 3);
    const DrawList sorted = listOf(coarse);
    DrawList empty = sorted;
    empty.transparent.clear();
    const Picture background = draw(coarse, empty), truth = draw(fine, listOf(fine));
    Layers layers(coarse, sorted, camera_, [&](const DrawList& list) { return draw(coarse, list); });
    const double byTriangles = apart(draw(coarse, sorted), truth);
    const double inOrder = apart(layers.picture(background,
                                                [](const std::vector<Layer>& here, Vec3d c) {
                                                    for (auto l = here.rbegin(); l != here.rend(); ++l)
                                                        c = l->color + (1 - l->alpha) * c;
                                                    return c;
                                                }),
                                 truth);
    EXPECT_LT(inOrder, 0.5) << "the layers are not those of the picture";
    double weighted = 255;
    for (const double scale : {1.0, 10.0, 100.0})
        for (int equation = 7; equation <= 9; ++equation) {
            const auto weight = [&](double depth) {
                const double z = scale * depth;
                const double near = equation == 7   ? 10 / (1e-5 + std::pow(z / 5, 2) + std::pow(z / 200, 6))
                                    : equation == 8 ? 10 / (1e-5 + std::pow(z / 10, 3) + std::pow(z / 200, 6))
                                                    : 0.03 / (1e-5 + std::pow(z / 200, 4));
                return std::clamp(near, 1e-2, 3e3);
            };
            weighted = std::min(weighted,
                                apart(layers.picture(background,
                                                     [&](const std::vector<Layer>& here, const Vec3d& behind) {
                                                         Vec3d sum = Vec3d::Zero();
                                                         double alphas = 0, through = 1;
                                                         for (const Layer& l : here) {
                                                             const double w = l.alpha * weight(l.depth);
                                                             sum += w * l.color;
                                                             alphas += w * l.alpha;
                                                             through *= 1 - l.alpha;
                                                         }
                                                         return Vec3d((1 - through) * sum / alphas + through * behind);
                                                     }),
                                      truth));
        }
    EXPECT_LT(2 * byTriangles, weighted);
    std::printf("seed %u: by triangles %.3f, its layers in order %.3f, weighted %.3f of 255\n", GetParam(), byTriangles,
                inOrder, weighted);
}

TEST_P(Glass, IsDrawnInOneOrderOnAllTilesAndByAllCullers) {
    const Aspect glass = makeGlass(GetParam(), 0);
    RenderScene all;
    all.update(glass, nullptr);
    const Picture whole = draw(glass, listOf(glass));
    for (const CullerKind kind : {CullerKind::kNone, CullerKind::kFrustum, CullerKind::kMasked})
        for (const PixelRect& rect : {PixelRect{0, 0, 130, 200}, PixelRect{130, 77, 190, 123}}) {
            const DrawList list = RenderAction(kind).run(all, camera_, rect, nullptr);
            const auto part = renderer_->draw(glass, list, camera_, rect);
            ASSERT_TRUE(part);
            for (int y = 0; y < rect.height; ++y)
                for (int x = 0; x < 3 * rect.width; ++x) {
                    const int row = 200 - rect.y - rect.height + y;
                    ASSERT_EQ(part->rgb[static_cast<std::size_t>(3 * rect.width * y + x)],
                              whole.rgb[static_cast<std::size_t>(3 * 320 * row + 3 * rect.x + x)])
                        << nameOf(kind) << " at " << rect.x + x / 3 << "," << row;
                }
        }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Glass, testing::Range(0u, 6u));

}  // namespace
}  // namespace tessera::test
