// Phong's surfaces, and how strongly others reflect (KHR_materials_specular, KHR_materials_ior), beside their formulas
// in double.
#include <algorithm>
#include <cmath>

#include "tests/unit/draw/RendererStage.h"
#include "tests/unit/draw/ShadedSurface.h"

namespace tessera {
namespace {

/// OpenGL 1.5, 2.14.1, with Blinn's half vector, of a light of radiance 1: no falloff, no ambient light of its own.
Vec3d phongOf(const Material& m, const Vec3d& n, const Vec3d& l, const Vec3d& v) {
    const double nl = n.dot(l);
    if (nl <= 0) return Vec3d::Zero();
    const double highlight = std::pow(std::max(n.dot((l + v).normalized()), 0.0), static_cast<double>(m.shininess));
    const Vec3d diffuse = m.baseColor.head<3>().cast<double>(),
                specular = static_cast<double>(m.specular) * m.specularColor.cast<double>();
    return nl * diffuse + highlight * specular;
}

/// KHR_materials_specular with KHR_materials_ior: a layer that reflects what Fresnel's term says over a diffuse base;
/// of metal glTF 2.0, B.3; with all bounces between facets.
Vec3d reflectedOf(const Material& m, const Vec3d& n, const Vec3d& l, const Vec3d& v) {
    const double nl = n.dot(l), nv = n.dot(v);
    if (nl <= 0) return Vec3d::Zero();
    const Vec3d h = (l + v).normalized(), base = m.baseColor.head<3>().cast<double>();
    const double grazing = std::pow(1 - v.dot(h), 5),
                 root = (static_cast<double>(m.ior) - 1) / (static_cast<double>(m.ior) + 1);
    const Vec3d straight = (root * root * m.specularColor.cast<double>()).cwiseMin(1.0);
    const double weight = m.specular;
    const Vec3d dielectric = weight * (straight + (Vec3d::Ones() - straight) * grazing),
                metal = base + (Vec3d::Ones() - base) * grazing;
    const double alpha2 = std::pow(static_cast<double>(m.roughness), 4), nh = n.dot(h);
    const auto smith = [&](double x) { return std::sqrt(alpha2 + (1 - alpha2) * x * x); };
    const double lobe = alpha2 / std::pow(nh * nh * (alpha2 - 1) + 1, 2) * 0.5 / (nl * smith(nv) + nv * smith(nl));
    const double share = m.metallic, lost = facetShares(static_cast<double>(m.roughness), nv).lost;
    const Vec3d shine = dielectric.cwiseProduct(bouncedOn(weight * straight, weight, lost)),
                metalShine = metal.cwiseProduct(bouncedOn(base, 1, lost));
    return nl * ((1 - share) * ((1 - dielectric.maxCoeff()) * base + shine * lobe) + share * metalShine * lobe);
}

class GlossTest : public RendererTest {
protected:
    static Vec3d towardsEye() { return Vec3d(-0.5 * 3.2 / kSidePx, 0.5 * 3.2 / kSidePx, 2.4).normalized(); }
    /// A sheet that fills the picture's middle, under one sun; `mapped`: an image says beside it what it says already;
    /// `beside`: a thing elsewhere in the picture.
    Rgb shown(Material material, const Vec3d& light, double strength, const Quatd& turned, bool mapped,
              const Material* beside = nullptr) {
        TestScene scene;
        scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero());
        scene.addDirectionalLight(-light, Vec3f::Ones(), static_cast<float>(strength));
        const std::array<std::uint8_t, 4> white{255, 255, 255, 255};
        if (mapped) material.occlusionImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(white)), 1, 1);
        scene.place(scene.add(makeSheet(1, 1), scene.add(material)), {0, 0, -0.001}, turned);
        if (beside) scene.place(scene.add(makeSheet(0.3, 0.3), scene.add(*beside)), {1.2, 0, -0.001});
        return center(draw(scene));
    }
    static int worstOf(const Rgb& is, const Vec3d& radiance) {
        const Rgb should = expectedOf(radiance.cast<float>());
        return std::max({std::abs(is.r - should.r), std::abs(is.g - should.g), std::abs(is.b - should.b)});
    }
    static std::vector<Quatd> turns() {
        std::vector<Quatd> turns;
        for (int k = 0; k < 6; ++k) turns.emplace_back(Eigen::AngleAxisd(0.13 * k - 0.35, Vec3d(1, 2, 0).normalized()));
        return turns;
    }
    const Vec3d light_ = Vec3d(0.5, 0.4, 0.8).normalized();
};

TEST_F(GlossTest, PhongIsOpenGlsFormula) {
    int bright = 0;
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (const float shininess : {0.0f, 1.0f, 8.0f, 32.0f, 120.0f})
            for (const float specular : {0.0f, 0.6f})
                for (const Quatd& turn : turns()) {
                    Material material{.baseColor = {0.5f, 0.3f, 0.1f, 1}, .metallic = 0.9f, .roughness = 0.1f};
                    material.shading = Material::kPhong;
                    material.specular = specular;
                    material.specularColor = {0.4f, 0.9f, 1};
                    material.shininess = shininess;
                    material.ior = 2.4f;
                    const Vec3d should = 0.6 * phongOf(material, turn * Vec3d::UnitZ(), light_, towardsEye());
                    bright += should.y() > 0.3;
                    for (const bool mapped : {false, true})
                        EXPECT_LE(worstOf(shown(material, light_, 0.6, turn, mapped), should), 2)
                            << "shininess " << shininess << ", " << samples << " samples" << (mapped ? ", mapped" : "");
                }
    }
    EXPECT_GT(bright, 20);
    // Behind: nothing, whatever the exponent.
    Material flat;
    flat.shading = Material::kPhong;
    flat.shininess = 0;
    EXPECT_EQ(shown(flat, -light_, 0.6, Quatd::Identity(), false).g, 0);
}

TEST_F(GlossTest, ReflectionIsThatOfSpecularColourAndIndex) {
    struct Case {
        float specular;
        Vec3f color;
        float ior, metallic;
    };
    const Case cases[] = {{1, {1, 1, 1}, 1.5f, 0},    {0, {1, 1, 1}, 1.5f, 0}, {0.5f, {1, 1, 1}, 1.5f, 0},
                          {1, {1, 1, 1}, 1, 0},       {1, {1, 1, 1}, 2.4f, 0}, {1, {1, 0.3f, 0}, 2.0f, 0},
                          {0.7f, {8, 2, 1}, 1.8f, 0}, {1, {1, 1, 1}, 20, 0},   {1, {0.2f, 1, 1}, 2.4f, 1},
                          {0, {1, 1, 1}, 1.5f, 1}};
    for (const Case& c : cases)
        for (const float roughness : {0.35f, 0.6f, 1.0f})
            for (const Quatd& turn : turns()) {
                Material material{.baseColor = {0.6f, 0.5f, 0.4f, 1}, .metallic = c.metallic, .roughness = roughness};
                material.specular = c.specular;
                material.specularColor = c.color;
                material.ior = c.ior;
                const Vec3d should = 0.5 * reflectedOf(material, turn * Vec3d::UnitZ(), light_, towardsEye());
                EXPECT_LE(worstOf(shown(material, light_, 0.5, turn, false), should), 2)
                    << "specular " << c.specular << ' ' << c.color.transpose() << " ior " << c.ior << " metal "
                    << c.metallic << " rough " << roughness;
            }
}

// What is beside it changes at most a rounding.
TEST_F(GlossTest, OthersLookAsTheyDidWithoutIt) {
    Material phong;
    phong.shading = Material::kPhong;
    for (const float metallic : {0.0f, 0.5f, 1.0f})
        for (const Quatd& turn : turns()) {
            const Material material{.baseColor = {0.8f, 0.5f, 0.2f, 1}, .metallic = metallic, .roughness = 0.5f};
            expectNear(shown(material, light_, 0.5, turn, false, &phong), shown(material, light_, 0.5, turn, false));
        }
}

// Glass is lit as it is drawn: nearly opaque, it is what it would be opaque.
TEST_F(GlossTest, GlassShinesAsWhatIsSolid) {
    for (const std::int64_t shading : {Material::kMetalRoughness, Material::kPhong})
        for (const Quatd& turn : turns()) {
            Material solid{.baseColor = {0.5f, 0.3f, 0.2f, 1}, .roughness = 0.4f};
            solid.shading = shading;
            solid.specular = 0.8f;
            solid.specularColor = {0.5f, 1, 0.7f};
            solid.ior = 2;
            Material glass = solid;
            glass.baseColor.w() = 0.9999f;
            const Rgb is = shown(glass, light_, 0.4, turn, false), should = shown(solid, light_, 0.4, turn, false);
            EXPECT_LE(std::max({std::abs(is.r - should.r), std::abs(is.g - should.g), std::abs(is.b - should.b)}), 2)
                << is << " and " << should;
        }
}

// OpenGL's lights mirror nothing of the surroundings.
TEST_F(GlossTest, PhongShowsNoSurroundings) {
    const auto shade = [&](std::int64_t shading) {
        TestScene scene;
        scene.setEnvironment(Vec3f::Constant(0.5f), Vec3f::Constant(0.5f), Vec3f::Zero());
        scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
        Material material{.baseColor = {0.4f, 0.4f, 0.4f, 1}, .roughness = 0.2f};
        material.shading = shading;
        material.ior = 3;
        scene.place(scene.add(makeSheet(1, 1), scene.add(material)), {0, 0, -0.001});
        return center(draw(scene));
    };
    expectNear(shade(Material::kPhong), expectedOf(Vec3f::Constant(0.2f)));
    EXPECT_GT(shade(Material::kMetalRoughness).g, shade(Material::kPhong).g + 20);
}

}  // namespace
}  // namespace tessera
