/// NurbsSurface in a scene: what is drawn of it, what is refused, what follows edits.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "common/drawable/Drawable.h"
#include "common/drawable/NurbsArrays.h"
#include "common/drawable/SmoothSurface.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "tests/support/words/Words.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

const ObjectId kNurbs(9);

Aspect sceneWithNurbs(const NurbsSurfaceCore& surface) {
    Aspect aspect = hall();
    Edits edits;
    const TypeInfo& type = *findType(NurbsSurfaceCore::kType);
    edits.create(kNurbs, type.type);
    NurbsSurfaceCore given = surface;
    given.material = ObjectId(7);
    for (const FieldEntry& field : type.fields) edits.set(kNurbs, type.type, field.id, field.read(&given));
    mustApply(aspect, edits.take());
    return aspect;
}
Drawable nurbsIn(const Aspect& aspect) {
    return drawableOf(aspect, kNurbs);
}

NurbsSurfaceCore sphere(std::vector<TrimLoop> loops = {}) {
    return coreOfSurface(*sphereSurface(1, std::move(loops)));
}

Blob numbersBlob(std::initializer_list<double> values) {
    return Blob::of(std::span<const double>(values.begin(), values.size()));
}

TEST(NurbsDrawable, ASphereIsDrawnAsOne) {
    NurbsSurfaceCore core = sphere();
    core.tolerance = 0.01;
    const Aspect aspect = sceneWithNurbs(core);
    const Drawable drawable = nurbsIn(aspect);
    ASSERT_TRUE(drawable);
    ASSERT_TRUE(drawable.check());
    EXPECT_TRUE(drawable.derived() && drawable.resident());
    EXPECT_EQ(drawable.material(), ObjectId(7));
    const MeshArrays arrays = drawable.arrays();
    EXPECT_TRUE(checkMesh(arrays));
    EXPECT_GT(drawable.triangleCount(), 500u);
    const auto positions = arrays.positions.as<float>(), normals = arrays.normals.as<float>(),
               texcoords = arrays.texcoords.as<float>();
    for (std::size_t i = 0; i < positions.size(); i += 3) {
        const Vec3f p(positions[i], positions[i + 1], positions[i + 2]), n(normals[i], normals[i + 1], normals[i + 2]);
        ASSERT_NEAR(p.norm(), 1, 1e-6);
        ASSERT_LT((p - n).norm(), 1e-5);
    }
    for (const float t : texcoords) ASSERT_TRUE(t >= 0 && t <= 1);
    // A coarser one is another mesh; the same again is the same, not made again.
    NurbsSurfaceCore coarse = core;
    coarse.tolerance = 0.1;
    EXPECT_LT(nurbsIn(sceneWithNurbs(coarse)).triangleCount(), drawable.triangleCount());
    EXPECT_EQ(nurbsIn(sceneWithNurbs(core)).arrays().positions.bytes().data(), arrays.positions.bytes().data());
    core.tolerance = 0;
    EXPECT_GT(nurbsIn(sceneWithNurbs(core)).triangleCount(), 1000u) << "a thousandth of its size";
}

TEST(NurbsDrawable, ACoreSaysTheSurfaceThatItWasMadeOf) {
    const auto made =
        torusSurface(2, 0.5, {{LoopRole::kHole, {circle({1.5, 1.5}, 0.4)}}, {LoopRole::kHole, {circle({3, 3}, 0.25)}}});
    ASSERT_TRUE(made);
    const auto again = surfaceOfCore(coreOfSurface(*made));
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->region().loops().size(), 2u);
    for (double u = 0; u <= 4; u += 0.37)
        for (double v = 0; v <= 4; v += 0.41) {
            const NurbsPoint a = evaluate(*made, u, v), b = evaluate(*again, u, v);
            EXPECT_LT((a.at.point - b.at.point).norm(), 1e-14);
            EXPECT_EQ(a.side, b.side);
        }
}

TEST(NurbsDrawable, WhatIsNoSurfaceIsRefusedByName) {
    const auto why = [](auto&& spoil, NurbsSurfaceCore surface = sphere()) {
        spoil(surface);
        const Aspect aspect = sceneWithNurbs(surface);
        const Expected<void> checked = nurbsIn(aspect).check();
        EXPECT_EQ(nurbsIn(aspect).arrays().positions.empty(), !checked) << "what is refused has no triangles";
        return checked ? std::string() : checked.error().message;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN(), zero = 0, far = 1e31;
    const auto with = [](const Blob& blob, std::size_t i, const double& x) {
        return *blob.withRange(8 * i, std::as_bytes(std::span(&x, 1)));
    };
    EXPECT_EQ(why([](NurbsSurfaceCore&) {}), "");
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.knotsU = numbersBlob({0, 0, 0, 1, 1, 1}); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.knotsU = numbersBlob({0, 0, 0, 0, 1, 2, 2, 3, 3, 4, 4, 4}); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.knotsV = with(s.knotsV, 1, nan); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.weights = with(s.weights, 3, zero); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.weights = numbersBlob({1, 1}); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.points = with(s.points, 0, nan); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.points = with(s.points, 0, far); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.points = numbersBlob({1}); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.range = numbersBlob({0, 5, 0, 1}); }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.degreeU = 24; }));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.tolerance = 1e-9; }));
    const NurbsSurfaceCore crossing =
        sphere({{LoopRole::kHole, {circle({2, 1}, 0.5)}}, {LoopRole::kHole, {circle({2.4, 1}, 0.5)}}});
    EXPECT_WORDS(why([](NurbsSurfaceCore&) {}, crossing));
    const NurbsSurfaceCore leaving = sphere({{LoopRole::kHole, {circle({2, 1.8}, 0.5)}}});
    EXPECT_WORDS(why([](NurbsSurfaceCore&) {}, leaving));
    const NurbsSurfaceCore trimmed = sphere({{LoopRole::kHole, {circle({2, 1}, 0.5)}}});
    EXPECT_EQ(why([](NurbsSurfaceCore&) {}, trimmed), "");
    const std::uint32_t many[] = {1, 7};
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.loops = Blob::of(std::span<const std::uint32_t>(many)); }, trimmed));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.curveKnots = numbersBlob({0, 1}); }, trimmed));
    EXPECT_WORDS(why([&](NurbsSurfaceCore& s) { s.curveRanges = numbersBlob({0, 1, 2, 3}); }, trimmed));
}

TEST(NurbsDrawable, AnEditOfOneControlPointGivesWhatAFreshSurfaceHas) {
    const NurbsSurfaceCore core = sphere();
    Aspect aspect = sceneWithNurbs(core);
    const MeshKey before = nurbsIn(aspect).key();
    NurbsSurfaceCore moved = core;
    const double x = 1.5;
    moved.points = *core.points.withRange(8 * 60, std::as_bytes(std::span(&x, 1)));
    const Aspect edited = sceneWithNurbs(moved);
    EXPECT_NE(nurbsIn(edited).key(), before);
    // Without the memory of where its points came from.
    const auto values = moved.points.as<double>();
    moved.points = Blob::of(std::span<const double>(values));
    EXPECT_EQ(nurbsIn(sceneWithNurbs(moved)).key(), nurbsIn(edited).key());
}

/// Control points of 4 MB whose patches would be gigabytes.
TEST(NurbsDrawable, WhatWouldHoldTheServerUpIsRefusedInWords) {
    NurbsSurfaceCore core;
    core.degreeU = core.degreeV = 24;
    std::vector<double> knots, points;
    for (int k = 0; k < 425; ++k) knots.push_back(k);
    for (int j = 0; j < 400; ++j)
        for (int i = 0; i < 400; ++i) points.insert(points.end(), {double(i), double(j), 0});
    core.knotsU = core.knotsV = Blob::of(std::span<const double>(knots));
    core.points = Blob::of(std::span<const double>(points));
    const Aspect aspect = sceneWithNurbs(core);
    const Expected<void> checked = nurbsIn(aspect).check();
    ASSERT_FALSE(checked);
    EXPECT_WORDS(checked.error().message);
    EXPECT_TRUE(nurbsIn(aspect).arrays().positions.empty());
    EXPECT_EQ(nurbsIn(aspect).smoothSurface(), nullptr);
}

/// What collision looks at instead of the triangles.
TEST(NurbsDrawable, TheSmoothSurfaceIsWhatTheFieldsStandFor) {
    const Aspect aspect = sceneWithNurbs(sphere());
    const std::shared_ptr<const SmoothSurface> smooth = nurbsIn(aspect).smoothSurface();
    ASSERT_NE(smooth, nullptr);
    const NurbsSurface& surface = std::get<NurbsSurface>(smooth->surface);
    for (const double u : {0.3, 1.7}) EXPECT_NEAR(evaluate(surface, u, 0.7).at.point.norm(), 1, 1e-12);
    NurbsSurfaceCore broken = sphere();
    broken.points = Blob();
    EXPECT_EQ(nurbsIn(sceneWithNurbs(broken)).smoothSurface(), nullptr);
    EXPECT_EQ(nurbsIn(sceneWithNurbs(NurbsSurfaceCore())).smoothSurface(), nullptr);
}

}  // namespace
}  // namespace tessera
