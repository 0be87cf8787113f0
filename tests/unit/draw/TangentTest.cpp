/// Normal maps in the tangents of vertices: pixels beside the algorithm's own formula; placed in mirrors and stretched,
/// given and made, edited in ranges; and what they take.
#include <gtest/gtest.h>

#include <random>

#include "common/drawable/TangentArrays.h"
#include "tests/support/surface/PooledSurface.h"
#include "tests/unit/draw/MaterialStage.h"
#include "tests/unit/draw/ShadedSurface.h"

namespace tessera {
namespace {

class TangentTest : public MaterialTest {
protected:
    /// Bumps that slope in all directions.
    static Image bumps() {
        return imageOf(32, [](int x, int y) {
            const Vec3d n = Vec3d(std::sin(0.7 * x), std::cos(0.9 * y), 1.2).normalized();
            const auto byte = [](double v) { return static_cast<std::uint8_t>(std::lround(127.5 * (v + 1))); };
            return Rgba{byte(n.x()), byte(n.y()), byte(n.z()), 255};
        });
    }
    static ScreenCamera camera() { return cameraOf(128, 128); }
    /// Under a light from the right and above.
    Picture drawn(const MeshArrays& arrays, const Affine3d& place, bool mapped = true) {
        TestScene scene = lit(Vec3d(0.5, 0.4, 0.7).normalized(), 0.8f);
        Material material = of({0.7, 0.7, 0.7});
        material.roughness = 0.5f;
        if (mapped) material.normalImage = scene.add(bumps());
        ObjectId id = scene.add(material);
        id = scene.add(arrays, id);
        // Turned after it was stretched: so its columns are across each other.
        const Vec3d scale = place.linear().colwise().norm();
        Mat3d turn = place.linear() * scale.cwiseInverse().asDiagonal();
        const double side = turn.determinant() < 0 ? -1 : 1;
        turn.col(0) *= side;
        scene.place(id, place.translation(), Quatd(turn), Vec3d(side * scale.x(), scale.y(), scale.z()));
        return draw(scene.take(), camera());
    }
    static double difference(const Picture& a, const Picture& b) {
        double sum = 0;
        for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(int{a.rgb[i]} - int{b.rgb[i]});
        return sum / static_cast<double>(a.rgb.size());
    }
    static Affine3d before(double turn = 0.6) {
        Affine3d place = Affine3d::Identity();
        place.translation() = Vec3d(0, 0, -1.5);
        place.linear() = Eigen::AngleAxisd(turn, Vec3d(1, 2, 0.5).normalized()).toRotationMatrix();
        return place;
    }
};

// Mikkelsen: of what is interpolated nothing is made unit or orthogonal again.
TEST_F(TangentTest, APixelIsWhatTheInterpolatedVectorsSay) {
    const Vec3d light = Vec3d(0.2, 0.3, 0.9).normalized(), inMap = Vec3d(0.35, -0.25, 0.9).normalized();
    const auto byte = [](double v) { return static_cast<std::uint8_t>(std::lround(127.5 * (v + 1))); };
    for (const float side : {1.0f, -1.0f}) {
        MeshData mesh;
        mesh.positions = {-0.5f, -0.5f, 0, 0.5f, -0.5f, 0, 0.1f, 0.7f, 0};
        const std::array<Vec3d, 3> normals = {Vec3d(-0.8, 0, 1).normalized(), Vec3d(0.9, 0.1, 1).normalized(),
                                              Vec3d(0, 0.9, 1).normalized()},
                                   tangents = {Vec3d(1, 0.5, 0).normalized(), Vec3d(1, -0.7, -0.9).normalized(),
                                               Vec3d(0.3, 1, 0.2).normalized()};
        for (std::size_t v = 0; v < 3; ++v) {
            for (const double x : normals[v]) mesh.normals.push_back(static_cast<float>(x));
            for (const double x : tangents[v]) mesh.tangents.push_back(static_cast<float>(x));
            mesh.tangents.push_back(side);
            mesh.texcoords.insert(mesh.texcoords.end(), {0.5f, 0.5f});
        }
        mesh.indices = {0, 1, 2};
        TestScene scene = lit(light, 0.7f);
        const Shaded surface{.base = {0.6, 0.6, 0.6}, .roughness = 0.6};
        Material material = of(surface.base);
        material.roughness = 0.6f;
        material.normalImage = scene.add(plain({byte(inMap.x()), byte(inMap.y()), byte(inMap.z()), 255}));
        scene.place(scene.add(mesh, scene.add(material)), {0, 0, -0.001});
        const Picture picture = draw(scene.take(), cameraOf(kSidePx, kSidePx));
        // The pixel's middle, where the screen is, and the corners' shares there.
        const double x = 0.5 * 3.2 / kSidePx, y = -0.5 * 3.2 / kSidePx;
        Mat3d corners;
        for (int v = 0; v < 3; ++v)
            corners.col(v) = Vec3d(mesh.positions[static_cast<std::size_t>(3 * v)],
                                   mesh.positions[static_cast<std::size_t>(3 * v + 1)], 1);
        const Vec3d shares = corners.inverse() * Vec3d(x, y, 1);
        Vec3d n = Vec3d::Zero(), t = Vec3d::Zero();
        for (int v = 0; v < 3; ++v) {
            n += shares[v] * normals[static_cast<std::size_t>(v)];
            t += shares[v] * tangents[static_cast<std::size_t>(v)];
        }
        const Vec3d m(byte(inMap.x()) / 127.5 - 1, byte(inMap.y()) / 127.5 - 1, byte(inMap.z()) / 127.5 - 1);
        const Vec3d bent = (m.x() * t + m.y() * static_cast<double>(side) * n.cross(t) + m.z() * n).normalized();
        expectNear(center(picture), expectedOf((0.7 * surface.reflected(bent, light, towardsEye())).cast<float>()));
    }
}

TEST_F(TangentTest, GivenOnesAndMadeOnesAreOnePicture) {
    const MeshArrays arrays = makeTorus(0.8, 0.4, 24, 16).toArrays();
    const MeshArrays given = withTangents(arrays, {});
    ASSERT_FALSE(given.tangents.empty());
    const Picture made = drawn(arrays, before());
    EXPECT_EQ(made.rgb, drawn(given, before()).rgb);
    EXPECT_GT(difference(made, drawn(arrays, before(), false)), 3) << "the bumps are seen";
}

// Mirrored, stretched, turned: what stands so is what was made so.
TEST_F(TangentTest, PlacesMoveTangentsAlong) {
    MeshData mesh = makeTorus(0.6, 0.3, 24, 16);
    const MeshArrays with = withTangents(mesh.toArrays(), {});
    const auto values = [](const Blob& blob) {
        const auto all = blob.as<float>();
        return std::vector<float>(all.begin(), all.end());
    };
    mesh.positions = values(with.positions);
    mesh.normals = values(with.normals);
    mesh.texcoords = values(with.texcoords);
    mesh.tangents = values(with.tangents);
    const auto indices = with.indices.as<std::uint32_t>();
    mesh.indices.assign(indices.begin(), indices.end());
    for (const Vec3d& scale : {Vec3d(1.2, 1.2, 1.2), Vec3d(-1, 1, 1), Vec3d(1, 0.5, 1.7), Vec3d(-1.5, 0.6, 1)}) {
        SCOPED_TRACE(scale.transpose());
        const Affine3d place = before() * Eigen::Scaling(scale);
        MeshData moved;
        moved.append(mesh, place);
        ASSERT_FALSE(moved.tangents.empty());
        const Picture placed = drawn(mesh.toArrays(), place);
        EXPECT_LT(difference(placed, drawn(moved.toArrays(), Affine3d::Identity())), 0.05);
        EXPECT_GT(difference(placed, drawn(mesh.toArrays(), place, false)), 20 * 0.05) << "the bumps are seen";
    }
}

TEST_F(TangentTest, MeshesWithoutNormalMapsPayNothing) {
    const MeshArrays arrays = makeTorus(0.8, 0.4, 24, 16).toArrays(), given = withTangents(arrays, {});
    MeshArrays bare = given;
    bare.tangents = {};
    const auto uploadedBy = [&](const MeshArrays& mesh, bool mapped) {
        restart({.samples = 1});
        const std::uint64_t before = renderer_->uploadedMeshBytes();
        (void)drawn(mesh, this->before(), mapped);
        return renderer_->uploadedMeshBytes() - before;
    };
    const std::uint64_t vertices = given.positions.sizeBytes() / 12, indices = given.indices.sizeBytes();
    EXPECT_EQ(uploadedBy(bare, false), 48 * vertices + indices);
    EXPECT_EQ(uploadedBy(given, false), 48 * vertices + indices);
    EXPECT_EQ(uploadedBy(given, true), 56 * vertices + indices);
    EXPECT_EQ(uploadedBy(arrays, true), 56 * vertices + indices);
}

// A pass over a transparent thing has a normal map of its own, which looks into other texture coordinates and is
// turned: the thing's own tangents say nothing of it. Sorted triangle by triangle or drawn as a whole.
TEST_F(TangentTest, EachPassOverSortedGlassHasTheTangentsOfItsOwnNormalMap) {
    const auto drawnBy = [&](bool sorted, bool baseMapped, bool passMapped) {
        TestScene scene = lit(Vec3d(0.5, 0.4, 0.7).normalized(), 0.8f);
        // No face of it hides another, so their order shows nothing.
        MeshData ball = makeSphere(0.9, 24);
        ball.texcoords1.resize(ball.texcoords.size());
        // Turned by a quarter and mirrored.
        for (std::size_t i = 0; i < ball.texcoords.size(); i += 2) {
            ball.texcoords1[i] = ball.texcoords[i + 1];
            ball.texcoords1[i + 1] = ball.texcoords[i];
        }
        Material base = of({0.7, 0.2, 0.2}), over = of({0.2, 0.2, 0.7});
        base.alphaMode = over.alphaMode = Material::kBlend;
        base.baseColor.w() = 0.6f;
        over.baseColor.w() = 0.5f;
        base.roughness = over.roughness = 0.5f;
        if (baseMapped) base.normalImage = scene.add(bumps());
        Image turned = bumps();
        turned.texcoordSet = 1;
        turned.rotation = 0.4f;
        if (passMapped) over.normalImage = scene.add(turned);
        base.passes.push_back(scene.add(over));
        scene.place(scene.add(ball, scene.add(base)), {0, 0, -1.5},
                    Quatd(Eigen::AngleAxisd(0.6, Vec3d(1, 2, 0.5).normalized())));
        const Aspect aspect = scene.take();
        DrawList list = listOf(aspect, camera());
        EXPECT_EQ(list.transparent.size(), 1u);
        EXPECT_GT(list.transparent.front().sortedCount, 0u);
        if (!sorted) list.transparent.front().sortedCount = 0;
        const auto picture = renderer_->draw(aspect, list, camera(), whole(camera()));
        EXPECT_TRUE(picture);
        return picture ? *picture : Picture();
    };
    for (const bool baseMapped : {false, true}) {
        SCOPED_TRACE(baseMapped);
        const Picture sorted = drawnBy(true, baseMapped, true), whole = drawnBy(false, baseMapped, true);
        EXPECT_EQ(sorted.rgb, whole.rgb);
        EXPECT_GT(difference(sorted, drawnBy(true, baseMapped, false)), 1) << "the pass's bumps are seen";
    }
}

TEST_F(TangentTest, AnEditedRangeIsThePictureOfWhoSeesItFirst) {
    const MeshArrays first = makeTorus(0.8, 0.4, 48, 32).toArrays();
    TestScene built = lit(Vec3d(0.5, 0.4, 0.7).normalized(), 0.8f);
    Material material = of({0.7, 0.7, 0.7});
    material.normalImage = built.add(bumps());
    const ObjectId id = built.add(withTangents(first, {}), built.add(material));
    built.place(id, {0, 0, -1.5});
    Aspect aspect = built.take();
    (void)draw(aspect, camera());
    std::mt19937 random(5);
    const std::uint64_t before = renderer_->uploadedMeshBytes();
    for (int turn = 0; turn < 6; ++turn) {
        ChangeListBuilder edits;
        const bool tangents = turn % 2 == 0;
        const FieldId field = tangents ? fieldId<&Geometry::tangents> : fieldId<&Geometry::positions>;
        const Blob& blob = tangents ? aspect.get<Geometry>(id)->tangents : aspect.get<Geometry>(id)->positions;
        const std::size_t count = 12, at = random() % (blob.sizeBytes() / 4 - count);
        std::vector<float> moved = blob.values<float>(at, count);
        for (float& x : moved) x += 0.2f * static_cast<float>(random() % 100) / 100;
        edits.setRange(id, typeOf<Geometry>(), field, 4 * at, Blob::of(std::span<const float>(moved)));
        ASSERT_TRUE(aspect.apply(edits.take()));
        const Picture followed = draw(aspect, camera());
        const auto otherSurface = test::pooledSurface();
        const auto other = Renderer::create(*otherSurface, {.samples = 1});
        ASSERT_TRUE(other);
        const auto fresh = (*other)->draw(aspect, listOf(aspect, camera()), camera(), whole(camera()));
        ASSERT_TRUE(fresh);
        EXPECT_EQ(followed.rgb, fresh->rgb) << turn;
    }
    EXPECT_LT(renderer_->uploadedMeshBytes() - before, 6u * 20 * 56) << "ranges, not meshes";
}

}  // namespace
}  // namespace tessera
