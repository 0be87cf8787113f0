// Diffuse light of the surroundings is what they do not mirror.
#include <cmath>

#include "tests/unit/draw/MaterialStage.h"
#include "tests/unit/draw/ShadedSurface.h"

namespace tessera {
namespace {

/// What a surface mirrors of white surroundings, with all bounces.
double mirrored(double f0, double f90, double roughness, double nv) {
    const FacetShares shares = facetShares(roughness, nv);
    return (f0 * (1 - shares.lost) + (f90 - f0) * shares.turned) * bouncedOn(Vec3d::Constant(f0), f90, shares.lost).x();
}

class MirroredLightTest : public MaterialTest {
protected:
    /// Under an even sky of 0.5 alone, which lamps of the studio outshine only in what is mirrored.
    Vec3d linear(Material material, double base, double turn) {
        material.baseColor = Vec4f::Constant(static_cast<float>(base));
        material.baseColor.w() = 1;
        TestScene scene;
        scene.setEnvironment(Vec3f::Constant(0.5f), Vec3f::Constant(0.5f), Vec3f::Zero());
        scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
        const Rgb shown = middleOf(scene, material, Quatd(Eigen::AngleAxisd(turn, Vec3d::UnitX())));
        return {linearOf(shown.r), linearOf(shown.g), linearOf(shown.b)};
    }
};

TEST_F(MirroredLightTest, WeakensTheDiffuseLightOfTheSky) {
    for (const double turn : {0.0, -0.9, -1.3})
        for (const float roughness : {1.0f, 0.6f, 0.3f}) {
            Material material;
            material.roughness = roughness;
            // What is mirrored is the same of black and of half white.
            const double apart = (linear(material, 0.5, turn) - linear(material, 0, turn)).x();
            const double nv = std::cos(turn);
            EXPECT_NEAR(apart, 0.5 * 0.5 * (1 - mirrored(0.04, 1, roughness, nv)), 0.006) << turn << " " << roughness;
        }
}

TEST_F(MirroredLightTest, TintedHighlightsTakeNoColourOutOfIt) {
    Material material;
    material.roughness = 0.5f;
    material.ior = 2;
    material.specularColor = Vec3f(1, 0.2f, 0);
    const Vec3d apart = linear(material, 0.5, 0) - linear(material, 0, 0);
    const double kept = 1 - mirrored(1.0 / 9, 1, 0.5, 1);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(apart[i], 0.25 * kept, 0.006) << i;
}

TEST_F(MirroredLightTest, IsAllOfItForPhongsWhichMirrorNothing) {
    Material material;
    material.shading = Material::kPhong;
    EXPECT_NEAR((linear(material, 0.5, -0.9) - linear(material, 0, -0.9)).x(), 0.25, 0.006);
}

}  // namespace
}  // namespace tessera
