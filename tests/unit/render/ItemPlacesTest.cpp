#include "client/render/ItemPlaces.h"

#include <cstring>
#include <random>

#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

using PlaceRows = std::array<float, places::kRowFloats>;

/// PlacedItems of all sizes, some mirrored, some flat, some of no extent at all, from here to a thousand kilometres.
struct PlacedItems {
    std::vector<Affine3d> world_T_items;
    std::vector<Box> boxes;

    explicit PlacedItems(std::size_t count) {
        std::mt19937 random(11);
        std::uniform_real_distribution<double> unit(-1, 1);
        for (std::size_t i = 0; i < count; ++i) {
            Affine3d place = Affine3d::Identity();
            const double size = std::pow(10.0, 3 * unit(random)), far = std::pow(10.0, 3 + 3 * unit(random));
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c) place(r, c) = size * unit(random);
            if (i % 5 == 1) place.linear().row(1) = place.linear().row(0);
            if (i % 7 == 2) place.linear().col(2).setZero();
            if (i % 11 == 3) place.linear().setZero();
            place.translation() = far * Vec3d(unit(random), unit(random), unit(random));
            Box box;
            box.lower = place.translation() + size * Vec3d(unit(random), unit(random), unit(random)) - Vec3d::Ones();
            box.upper = box.lower + size * Vec3d(1 + unit(random), 1 + unit(random), 1 + unit(random));
            world_T_items.push_back(place);
            boxes.push_back(box);
        }
    }
};

std::vector<PlaceRows> rowsBy(const places::PlaceKernels& kernels, const Affine3d& eye_T_world,
                              const PlacedItems& items, std::size_t first, std::size_t count) {
    std::vector<places::Matrix> world_T_items;
    std::vector<PlaceRows> rows(count);
    std::vector<float*> to;
    for (std::size_t i = 0; i < count; ++i) {
        world_T_items.push_back(items.world_T_items[first + i].data());
        to.push_back(rows[i].data());
    }
    kernels.beforeEye(eye_T_world.data(), world_T_items.data(), to.data(), count);
    return rows;
}

std::vector<places::Rectangle> rectanglesBy(const places::PlaceKernels& kernels, const TileProjection& screen,
                                            const PlacedItems& items) {
    std::vector<places::Matrix> world_T_items;
    std::vector<const double*> boxes;
    for (std::size_t i = 0; i < items.boxes.size(); ++i) {
        world_T_items.push_back(items.world_T_items[i].data());
        boxes.push_back(items.boxes[i].lower.data());
    }
    std::vector<places::Rectangle> found(boxes.size());
    kernels.onScreen(screen.screen(), boxes.data(), world_T_items.data(), found.data(), found.size());
    return found;
}

Affine3d someEye() {
    Affine3d eye = Affine3d::Identity();
    eye.linear() = Eigen::AngleAxisd(0.7, Vec3d(0.2, 1, -0.4).normalized()).toRotationMatrix();
    eye.translation() = Vec3d(1.25, -3, 0.1);
    return eye;
}

TEST(ItemPlaces, AreRoundedOnceAndTurnNormals) {
    const PlacedItems items(1000);
    const Affine3d eye = someEye();
    const std::vector<PlaceRows> rows = rowsBy(*placeKernelsHere().back(), eye, items, 0, items.boxes.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Affine3d place = eye * items.world_T_items[i];
        const double size = place.matrix().cwiseAbs().maxCoeff();
        Mat3d normals;
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 4; ++c) {
                const auto at = static_cast<std::size_t>(4 * r + c);
                EXPECT_NEAR(static_cast<double>(rows[i][at]), place(r, c),
                            std::abs(place(r, c)) / (1 << 23) + 1e-14 * size);
                if (c < 3)
                    normals(r, c) = static_cast<double>(rows[i][12 + at]);
                else
                    EXPECT_EQ(rows[i][12 + at], 0);
            }
        // Normals stay upright on what is turned and stretched, and point outwards in a mirror.
        const Mat3d m = place.linear();
        const Mat3d upright = normals.transpose() * m;
        EXPECT_LE((upright - upright.trace() / 3 * Mat3d::Identity()).norm(), 1e-6 * m.norm()) << i;
        EXPECT_GE(upright.trace(), -1e-6 * m.norm()) << i;
        EXPECT_TRUE(normals.cwiseAbs().maxCoeff() == 1 || normals.isZero()) << i;
    }
}

TEST(ItemPlaces, AreTheSameBitsAloneAndAmongOthersByAllInstructionSets) {
    const PlacedItems items(203);
    const Affine3d eye = someEye();
    const std::vector<PlaceRows> wanted = rowsBy(*placeKernelsHere().front(), eye, items, 0, items.boxes.size());
    for (const places::PlaceKernels* kernels : placeKernelsHere()) {
        const std::vector<PlaceRows> all = rowsBy(*kernels, eye, items, 0, items.boxes.size());
        for (std::size_t i = 0; i < all.size(); ++i) {
            EXPECT_EQ(std::memcmp(&all[i], &wanted[i], sizeof(PlaceRows)), 0) << i;
            for (std::size_t count = 1; count <= std::min<std::size_t>(6, all.size() - i); ++count) {
                const std::vector<PlaceRows> few = rowsBy(*kernels, eye, items, i, count);
                EXPECT_EQ(std::memcmp(few.data(), &wanted[i], count * sizeof(PlaceRows)), 0) << count << " from " << i;
            }
        }
    }
}

TEST(ItemPlaces, OnAScreenHoldEveryPointOfTheirBoxes) {
    const TestCamera wall{160, 120, 2, 1};
    const ScreenCamera camera = wall.camera();
    const TileProjection screen(camera, {.x = 100, .y = 20, .width = 160, .height = 96});
    PlacedItems items(4000);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    const std::vector<places::Rectangle> wanted = rectanglesBy(*placeKernelsHere().front(), screen, items);
    std::size_t known = 0, unknown = 0;
    for (const places::PlaceKernels* kernels : placeKernelsHere()) {
        const std::vector<places::Rectangle> found = rectanglesBy(*kernels, screen, items);
        EXPECT_EQ(std::memcmp(found.data(), wanted.data(), found.size() * sizeof found[0]), 0);
        for (std::size_t i = 0; i < found.size(); ++i) {
            const Box& box = items.boxes[i];
            const Footprint exact = screen.footprint(screen.clip_T_world(), box, 0);
            const places::Rectangle& f = found[i];
            const bool isKnown = f.lowerX <= f.upperX && f.lowerY <= f.upperY;
            EXPECT_FALSE(exact.nearPlane && isKnown) << i;
            (isKnown ? known : unknown) += 1;
            if (!isKnown) continue;
            // Not much larger, either: a sum of components is less than 1.75 lengths.
            const Vec3d origin = items.world_T_items[i].translation();
            const double reach = (box.upper - origin).cwiseAbs().cwiseMax((box.lower - origin).cwiseAbs()).norm();
            const Footprint loose = screen.footprint(screen.clip_T_world(), box, 1.75 * screen.noise(reach, box));
            if (loose.nearPlane) continue;
            EXPECT_LE(loose.lowerX, f.lowerX) << i;
            EXPECT_LE(loose.lowerY, f.lowerY) << i;
            EXPECT_GE(loose.upperX, f.upperX) << i;
            EXPECT_GE(loose.upperY, f.upperY) << i;
            for (int k = 0; k < 20; ++k) {
                const Vec3d p = box.lower + Vec3d(unit(random), unit(random), unit(random)).cwiseProduct(box.size());
                const Vec4d c = screen.clip_T_world() * p.homogeneous();
                const double x = screen.xPx(c.x(), c.w()), y = screen.yPx(c.y(), c.w());
                EXPECT_TRUE(f.lowerX <= x && x <= f.upperX && f.lowerY <= y && y <= f.upperY) << i;
            }
        }
    }
    EXPECT_GT(known, 500u);
    EXPECT_GT(unknown, 500u);
}

}  // namespace
}  // namespace tessera
