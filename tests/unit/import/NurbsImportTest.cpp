// NURBS of texts and of OBJ's free-form statements: what comes into the scene, and what is refused by name.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <span>

#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/NurbsArrays.h"
#include "common/drawable/SmoothSurface.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> importedSurfaces(const std::string& name, const std::string& content) {
    const Scratch scratch;
    return importScene(scratch.write(name, content), kRootNode, importOptions());
}

std::string whyNot(const std::string& name, const std::string& content) {
    const Expected<ImportedScene> scene = importedSurfaces(name, content);
    return scene ? std::string("it was read") : scene.error().message;
}

/// A flat square from (0, 0) to (1, 1) in a text, and what else is said of it.
std::string squareText(const std::string& more) {
    return "material { name: \"red\" base_color { r: 1 } }\n"
           "node { name: \"square\" material: \"red\" nurbs_surface { degree_u: 1 degree_v: 1 count_u: 2\n"
           "  point {} point { x: 1 } point { y: 1 } point { x: 1 y: 1 } " +
           more + " } }\n";
}

TEST(NurbsImport, OfATextIsWhatItSays) {
    Expected<ImportedScene> scene = importedSurfaces("a.tsct", squareText(""));
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    EXPECT_EQ(scene->triangles, 2u);
    const ImportedAspect aspect(std::move(*scene));
    const auto* core = aspect.core<NurbsSurfaceCore>("/square");
    ASSERT_NE(core, nullptr);
    EXPECT_EQ(core->degreeU, 1);
    const auto knots = core->knotsU.as<double>();
    EXPECT_EQ(std::vector<double>(knots.begin(), knots.end()), (std::vector<double>{0, 0, 1, 1}));
    ASSERT_NE(aspect->get<Material>(core->material), nullptr);
    EXPECT_EQ(aspect->get<Material>(core->material)->baseColor.x(), 1);
}

TEST(NurbsImport, ATrimOfATextCutsAHole) {
    const std::string hole =
        "loop { hole: true curve { degree: 1 point { x: 0.25 y: 0.25 } point { x: 0.75 y: 0.25 } point { x: 0.5 y: "
        "0.75 } point { x: 0.25 y: 0.25 } } }";
    Expected<ImportedScene> scene = importedSurfaces("a.tsct", squareText(hole));
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_GT(scene->triangles, 2u);
}

TEST(NurbsImport, ASurfaceWithoutAnAreaIsNoted) {
    const Expected<ImportedScene> scene =
        importedSurfaces("a.tsct",
                         "node { name: \"point\" nurbs_surface { degree_u: 1 degree_v: 1 count_u: 2 point {} point {} "
                         "point {} point {} } }\n");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 0u);
    ASSERT_EQ(scene->notes.size(), 1u);
    EXPECT_WORDS(scene->notes[0]);
}

TEST(NurbsImport, WhatIsNoSurfaceIsRefusedWithItsPlace) {
    EXPECT_WORDS(whyNot("a.tsct", squareText("knot_u: [0, 0, 1]")));
    EXPECT_WORDS(whyNot("a.tsct", squareText("knot_v: [0, 0, 0, 1]")));
    EXPECT_WORDS(whyNot("a.tsct", squareText("weight: [1, 1, 0, 1]")));
    EXPECT_WORDS(whyNot("a.tsct", squareText("weight: [1, 1]")));
    EXPECT_WORDS(whyNot("a.tsct", squareText("point { x: nan }")));
    EXPECT_WORDS(whyNot("a.tsct", squareText("tolerance: -1")));
    EXPECT_WORDS(whyNot("a.tsct", squareText("begin_u: 0.5")));
    EXPECT_WORDS(whyNot("a.tsct", squareText("material: \"blue\"")));
    const std::string triangle =
        "curve { point { x: 0.25 y: 0.25 } point { x: 0.75 y: 0.25 } point { x: 0.5 y: 0.75 } point { x: 0.25 y: 0.25 "
        "} }";
    EXPECT_WORDS(whyNot("a.tsct", squareText("loop { " + triangle + " } loop { hole: true " + triangle + " }")));
    EXPECT_WORDS(whyNot("a.tsct", squareText("loop { curve { point { x: 2 } point { y: 1 } point { x: 2 } } }")));
}

/// What a node "it" of this text shows: the surface, and its triangles.
struct Shown {
    NurbsSurface surface;
    MeshArrays drawn;
};
std::optional<Shown> shownOf(const std::string& primitive) {
    Expected<ImportedScene> scene =
        importedSurfaces("a.tsct", "node { name: \"it\" nurbs_surface { tolerance: 0.001 " + primitive + " } }\n");
    EXPECT_TRUE(scene) << messageOf(scene);
    if (!scene) return std::nullopt;
    EXPECT_TRUE(scene->notes.empty());
    const ImportedAspect aspect(std::move(*scene));
    const Drawable drawable(*findDrawable(NurbsSurfaceCore::kType), aspect.core<NurbsSurfaceCore>("/it"));
    const auto smooth = drawable.smoothSurface();
    if (!smooth) return std::nullopt;
    return Shown{std::get<NurbsSurface>(smooth->surface), drawable.arrays()};
}

/// `offBy`: how far a place is from the shape; `outwards`: a direction that its normals do not oppose.
void expectShape(const std::string& primitive, const std::function<double(const Vec3d&)>& offBy,
                 const std::function<Vec3d(const Vec3d&)>& outwards) {
    SCOPED_TRACE(primitive);
    const std::optional<Shown> shown = shownOf(primitive);
    ASSERT_TRUE(shown);
    const ParameterRectangle& all = shown->surface.domain();
    constexpr int kSteps = 40;
    for (int i = 0; i <= kSteps; ++i)
        for (int j = 0; j <= kSteps; ++j) {
            const double u = all.u.lower + (all.u.upper - all.u.lower) * i / kSteps,
                         v = all.v.lower + (all.v.upper - all.v.lower) * j / kSteps;
            const SurfacePoint at = evaluate(shown->surface, u, v).at;
            ASSERT_LT(std::abs(offBy(at.point)), 1e-13) << u << " " << v;
            ASSERT_GE(at.normal.dot(outwards(at.point)), -1e-12) << u << " " << v;
        }
    const std::span<const float> xyz = shown->drawn.positions.as<float>();
    const std::span<const std::uint32_t> corners = shown->drawn.indices.as<std::uint32_t>();
    ASSERT_GT(corners.size(), 300U);
    const auto place = [&](std::uint32_t v) { return Vec3d(xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]); };
    for (std::size_t t = 0; t < corners.size(); t += 3) {
        const Vec3d a = place(corners[t]), b = place(corners[t + 1]), c = place(corners[t + 2]);
        for (const Vec3d& p : {a, Vec3d((a + b) / 2), Vec3d((a + b + c) / 3)}) ASSERT_LT(std::abs(offBy(p)), 0.0011);
        ASSERT_GE((b - a).cross(c - a).dot(outwards((a + b + c) / 3)), 0) << "inside out";
    }
}

TEST(NurbsImport, PrimitivesOfATextAreTheShapesThatTheySay) {
    const auto fromAxis = [](const Vec3d& p) { return std::hypot(p.x(), p.z()); };
    const auto away = [](const Vec3d& p) { return Vec3d(p.x(), 0, p.z()); };
    expectShape(
        "sphere { radius: 0.7 }", [](const Vec3d& p) { return p.norm() - 0.7; }, [](const Vec3d& p) { return p; });
    expectShape(
        "torus { ring_radius: 1 pipe_radius: 0.25 }",
        [&](const Vec3d& p) { return std::hypot(fromAxis(p) - 1, p.y()) - 0.25; },
        [&](const Vec3d& p) { return Vec3d(p - away(p).normalized()); });
    expectShape(
        "cylinder { radius: 0.5 height: 2 }",
        [&](const Vec3d& p) {
            return std::max(fromAxis(p) - 0.5, std::abs(p.y() - 1) - 1) * (p.y() >= 0 && p.y() <= 2 ? 1 : 9);
        },
        away);
    // A slope of 3 to 4: what is off along x is off by four fifths.
    expectShape(
        "cone { lower_radius: 1.5 height: 2 }",
        [&](const Vec3d& p) { return 0.8 * (fromAxis(p) - 0.75 * (2 - p.y())); }, away);
    expectShape(
        "cone { lower_radius: 0.5 upper_radius: 2 height: 2 }",
        [&](const Vec3d& p) { return 0.8 * (fromAxis(p) - 0.5 - 0.75 * p.y()); }, away);
}

TEST(NurbsImport, PrimitivesMayBeCutToAPartAndTrimmed) {
    const std::optional<Shown> half = shownOf("sphere { radius: 1 } begin_v: 1");
    ASSERT_TRUE(half);
    for (const double v : {1.0, 1.3, 2.0}) EXPECT_GE(evaluate(half->surface, 2.5, v).at.point.y(), -1e-15);
    EXPECT_EQ(half->surface.domain().v.lower, 1);
    const std::string hole =
        "loop { hole: true curve { point { x: 0.5 y: 0.25 } point { x: 3.5 y: 0.25 } point { x: 2 y: 0.75 } point { x: "
        "0.5 y: 0.25 } } }";
    const std::optional<Shown> whole = shownOf("cylinder { radius: 1 height: 1 }"),
                               trimmed = shownOf("cylinder { radius: 1 height: 1 } " + hole);
    ASSERT_TRUE(whole && trimmed);
    EXPECT_EQ(trimmed->surface.region().loops().size(), 1U);
    const auto areaOf = [](const MeshArrays& mesh) {
        double area = 0;
        const auto xyz = mesh.positions.as<float>();
        const auto corners = mesh.indices.as<std::uint32_t>();
        const auto place = [&](std::uint32_t v) { return Vec3d(xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]); };
        for (std::size_t t = 0; t < corners.size(); t += 3)
            area += 0.5 *
                    (place(corners[t + 1]) - place(corners[t])).cross(place(corners[t + 2]) - place(corners[t])).norm();
        return area;
    };
    EXPECT_LT(areaOf(trimmed->drawn), areaOf(whole->drawn) - 0.5);
}

TEST(NurbsImport, WhatIsNoPrimitiveIsRefusedWithItsPlace) {
    const auto why = [](const std::string& content) {
        return whyNot("a.tsct", "node { name: \"it\" nurbs_surface { " + content + " } }\n");
    };
    EXPECT_WORDS(why("sphere { radius: 0 }"));
    EXPECT_WORDS(why("sphere { radius: nan }"));
    EXPECT_WORDS(why("torus { ring_radius: 1 }"));
    EXPECT_WORDS(why("cylinder { radius: 1 height: -2 }"));
    EXPECT_WORDS(why("cone { height: 1 }"));
    EXPECT_WORDS(why("cone { height: 1 lower_radius: 1 upper_radius: -1 }"));
    for (const char* more : {"degree_u: 2", "point {}", "knot_v: [0, 1]", "weight: [1]", "count_u: 9"})
        EXPECT_WORDS(why(std::string("sphere { radius: 1 } ") + more)) << more;
    EXPECT_WORDS(why("sphere { radius: 1 } torus { ring_radius: 1 pipe_radius: 1 }")) << "two of them";
}

/// Two squares in two groups, the second with a hole.
constexpr const char* kTwoSquares = R"(v 0 0 0
v 1 0 0
v 0 1 0
v 1 1 0
vp 0.2 0.2
vp 0.8 0.2
vp 0.5 0.8
cstype bspline
deg 1
curv2 1 2 3 1
parm u 0 0 1 2 3 3
end
g left
cstype bspline
deg 1 1
surf 0 1 0 1 1 2 3 4
parm u 0 0 1 1
parm v 0 0 1 1
end
g right
surf 0 1 0 1 1 2 3 4
parm u 0 0 1 1
parm v 0 0 1 1
hole 0 3 1
end
)";

TEST(NurbsImport, OfAnObjIsANodePerSurface) {
    Expected<ImportedScene> scene = importedSurfaces("plates.obj", kTwoSquares);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    const ImportedAspect aspect(std::move(*scene));
    const auto* left = aspect.core<NurbsSurfaceCore>("/plates/left");
    const auto* right = aspect.core<NurbsSurfaceCore>("/plates/right");
    ASSERT_NE(left, nullptr);
    ASSERT_NE(right, nullptr);
    EXPECT_TRUE(left->loops.empty());
    EXPECT_EQ(right->loops.sizeBytes(), 8u);
    const auto surface = surfaceOfCore(*right);
    ASSERT_TRUE(surface) << surface.error().message;
    EXPECT_EQ(evaluate(*surface, 0.5, 0.4).side, TrimSide::kTrimmedAway);
    EXPECT_EQ(evaluate(*surface, 0.1, 0.4).side, TrimSide::kKept);
    EXPECT_TRUE(aspect->get<Material>(left->material)->doubleSided);
}

TEST(NurbsImport, AnObjMayHavePolygonsToo) {
    const std::string faces = "v 5 0 0\nv 6 0 0\nv 6 1 0\nusemtl gold\nf -3 -2 -1\nl 5 6\n";
    Expected<ImportedScene> scene = importedSurfaces("plates.obj", kTwoSquares + faces);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->notes.size(), 2u) << "what is left out is said";
    std::size_t surfaces = 0, meshes = 0;
    const ImportedAspect aspect(std::move(*scene));
    for (const ObjectId id : aspect->ids()) {
        surfaces += aspect->get<NurbsSurfaceCore>(id) != nullptr;
        meshes += aspect->get<Geometry>(id) != nullptr;
    }
    EXPECT_EQ(surfaces, 2u);
    EXPECT_EQ(meshes, 1u);
}

TEST(NurbsImport, FreeFormStatementsOfAnObjThatNobodyReadsAreNamed) {
    const auto noteOf = [](const std::string& text) {
        Expected<ImportedScene> scene = importedSurfaces("plates.obj", text);
        EXPECT_TRUE(scene) << messageOf(scene);
        return scene && scene->notes.size() == 1 ? scene->notes.front()
                                                 : std::to_string(scene ? scene->notes.size() : 0) + " notes";
    };
    const std::string curve = "cstype bezier\ndeg 1\ncurv 0 1 1 2\nparm u 0 1\nend\n";
    EXPECT_WORDS(noteOf(kTwoSquares + curve));
    EXPECT_WORDS(noteOf(kTwoSquares + curve + curve));
    // What joins and marks; a curve in a plane that no trim takes.
    const std::string more =
        "vp 0 0\nvp 1 1\ncstype bezier\ndeg 1\ncurv2 -2 -1\nparm u 0 1\nend\ncon 1 0 1 1 2 0 1 1\nmg off\nmg 1 "
        "0.5\nctech cparm 4\nstech cparma 4 4\n";
    const std::string note = noteOf(kTwoSquares + more);
    EXPECT_WORDS(note);
    EXPECT_EQ(note.find("curv ("), std::string::npos) << note;
    // Without a surface the polygons come all the same, also beside statements of version 2.11.
    const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (const std::string& extra :
         {curve, std::string("bzp 1 2 3 1 2 3 1 2 3 1 2 3 1 2 3 1\n"), std::string("res 4 4\n")}) {
        Expected<ImportedScene> scene = importedSurfaces("curve.obj", triangle + extra);
        ASSERT_TRUE(scene) << extra << messageOf(scene);
        EXPECT_WORDS(notesIn(*scene)) << extra;
        const ImportedAspect aspect(std::move(*scene));
        EXPECT_TRUE(std::ranges::any_of(aspect->ids(), [&](ObjectId id) {
            return aspect->get<Geometry>(id) != nullptr;
        })) << extra;
    }
}

TEST(NurbsImport, ASurfaceOfAnObjTakesTheMaterialInForce) {
    const Scratch folder;
    folder.write("paints.mtl", "newmtl old gold\nKd 1 0.8 0.25\nnewmtl glass\nKd 0.2 0.3 0.4\nd 0.5\n");
    std::string text = kTwoSquares;
    text.insert(text.find("g left"), "mtllib paints.mtl\nusemtl old gold\n");
    text.insert(text.find("g right"), "usemtl glass\n");
    Expected<ImportedScene> scene = importScene(folder.write("plates.obj", text), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
    const ImportedAspect aspect(std::move(*scene));
    const auto materialOf = [&](const char* node) {
        return *aspect->get<Material>(aspect.core<NurbsSurfaceCore>(node)->material);
    };
    EXPECT_NEAR(materialOf("/plates/left").baseColor.y(), 0.8, 0.01);
    EXPECT_TRUE(materialOf("/plates/left").doubleSided);
    EXPECT_NEAR(materialOf("/plates/right").baseColor.z(), 0.4, 0.01);
    EXPECT_NEAR(materialOf("/plates/right").baseColor.w(), 0.5, 0.01);
}

TEST(NurbsImport, AMaterialOfASurfaceThatIsNotThereIsNamed) {
    const Scratch folder;
    folder.write("paints.mtl", "newmtl gold\nKd 1 0.8 0.25\n");
    const auto notesOf = [&](const std::string& before) {
        const Expected<ImportedScene> scene =
            importScene(folder.write("plates.obj", before + kTwoSquares), kRootNode, importOptions());
        EXPECT_TRUE(scene) << messageOf(scene);
        std::string all;
        for (const std::string& note : scene ? scene->notes : std::vector<std::string>()) all += note + "\n";
        return all;
    };
    EXPECT_WORDS(notesOf("mtllib paints.mtl\nusemtl silver\n"));
    EXPECT_WORDS(notesOf("mtllib nowhere.mtl\nusemtl gold\n"));
    EXPECT_EQ(notesOf("usemtl gold\n"), "") << "without a library nothing is said of looks";
}

TEST(NurbsImport, AnObjsMistakesAreNamedWithTheirLine) {
    std::string text = kTwoSquares;
    text.replace(text.find("parm v 0 0 1 1"), 14, "parm v 0 0 1 x");
    EXPECT_WORDS(whyNot("plates.obj", text));
}

}  // namespace
}  // namespace tessera
