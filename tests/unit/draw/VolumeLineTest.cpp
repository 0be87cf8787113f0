/// Where the light in clouds might break off: fields are smooth, and so is what is lit in them, however near one looks.
#include <gtest/gtest.h>

#include "tests/unit/draw/VolumeStage.h"

namespace tessera {
namespace {

using VolumeLine = VolumeStage;

constexpr std::int64_t kSmoothSide = 17;
constexpr double kSmoothSpacing = 0.125;
constexpr int kMostApart = 6;  ///< of 255, from a pixel to the next

/// From 0 to 1, in a box of 2 around the origin.
struct SmoothField {
    enum Kind : std::uint32_t { kSlab, kRidge, kSlope, kThread, kBall, kKinds };
    Kind kind;
    Vec3d along;  ///< of length 1: across a slab, up a slope, down a thread
    double width;

    [[nodiscard]] double at(const Vec3d& p) const {
        const double a = along.dot(p) / width;
        if (kind == kSlab) return std::exp(-a * a);
        if (kind == kRidge) return std::max(0.0, 1 - std::abs(a));
        if (kind == kSlope) return 0.5 + 0.25 * along.dot(p);
        const double r2 =
            (kind == kThread ? p.squaredNorm() - along.dot(p) * along.dot(p) : p.squaredNorm()) / (width * width);
        return std::exp(-r2);
    }
};

Volume volumeOf(const SmoothField& field, FieldDice& dice) {
    Volume v;
    v.sizeX = v.sizeY = v.sizeZ = kSmoothSide;
    v.format = Volume::kFloat;
    v.spacing = Vec3d::Constant(kSmoothSpacing);
    v.origin = Vec3d::Constant(-1);
    std::vector<double> values;
    for (int z = 0; z < kSmoothSide; ++z)
        for (int y = 0; y < kSmoothSide; ++y)
            for (int x = 0; x < kSmoothSide; ++x)
                values.push_back(field.at(v.origin + kSmoothSpacing * Vec3d(x, y, z)));
    v.voxels = numbersFrom<float>(values);
    v.low = 0;
    v.high = 1;
    const auto least = static_cast<std::uint8_t>(dice.below(60)),
               most = static_cast<std::uint8_t>(100 + dice.below(156));
    const std::vector<std::uint8_t> transfer = {255, 255, 255, least, 255, 255, 255, most};
    v.transfer = Blob::of(std::span<const std::uint8_t>(transfer));
    v.thickness = dice.any(0.1, 1.5);
    v.step = dice.any(0.1, 0.5);
    v.shaded = true;
    // Cut open through the middle now and then, so that it is seen there.
    if (dice.below(2) == 0) {
        const Vec3d n = (Vec3d(0, 0, 1) + dice.vector(0.8)).normalized();
        const std::vector<double> plane = {n.x(), n.y(), n.z(), 0};
        v.clipPlanes = Blob::of(std::span<const double>(plane));
    }
    return v;
}

// Pixels are a 400th of a voxel wide there: what is smooth differs little from one to the next. The eye looks along the
// middle of slabs, along slopes, down threads, and from anywhere.
TEST_F(VolumeLine, NoLineRunsThroughWhatIsSmooth) {
    int lit = 0, most = 0;
    for (const unsigned seed : volumeSeeds(150)) {
        FieldDice dice(seed);
        const Vec3d eye(dice.any(-0.5, 0.5), dice.any(-0.5, 0.5), 2.4);
        SmoothField field{static_cast<SmoothField::Kind>(seed % SmoothField::kKinds), dice.vector(1).normalized(),
                          dice.any(0.2, 0.6)};
        if (dice.below(3) != 0)
            field.along =
                field.kind == SmoothField::kThread ? eye.normalized() : Vec3d(field.along.cross(eye).normalized());
        TestScene scene;
        scene.setDark(Vec3f::Zero());
        for (std::uint32_t i = 0, count = 1 + dice.below(2); i < count; ++i)
            scene.addDirectionalLight(dice.vector(1).normalized(), Vec3f::Ones(), 0.8f);
        scene.addNode(scene.addCore(volumeOf(field, dice)));
        const Picture picture = draw(scene.take(), cameraOf(kSidePx, kSidePx, eye, kSidePx * kSmoothSpacing / 400));
        int worst = 0;
        for (int y = 1; y < kSidePx; ++y)
            for (int x = 1; x < kSidePx; ++x) {
                const int here = pixel(picture, x, y).g;
                worst = std::max(
                    {worst, std::abs(here - pixel(picture, x - 1, y).g), std::abs(here - pixel(picture, x, y - 1).g)});
                lit += here > 20;
            }
        most = std::max(most, worst);
        EXPECT_LE(worst, kMostApart) << "field " << field.kind << "\nTESSERA_SEED=" << seed
                                     << " unit_draw --gtest_filter=VolumeLine.*";
    }
    RecordProperty("mostOff", most);
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(lit, 100'000);
    }
}

}  // namespace
}  // namespace tessera
