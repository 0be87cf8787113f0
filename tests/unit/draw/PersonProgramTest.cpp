// Programs of persons, in every pass that draws a surface.
#include "client/draw/shaders/PersonPrograms.h"
#include "tests/support/words/Words.h"
#include "tests/unit/draw/ProgramStage.h"

namespace tessera {
namespace {

TEST_F(PersonProgramTest, SaysTheColourByItsUniforms) {
    Programmed p;
    p.program.surface =
        "uniform vec3 tint;\nuniform float half_;\nuniform vec2 unsaid;\nvoid surface(inout Surface s) { s.base.rgb = "
        "tint * half_ + vec3(unsaid, 0.0); }";
    p.uniforms = {{.name = "tint", .value = Vec4f(0.8f, 0.4f, 0.2f, 9)},
                  {.name = "half_", .value = Vec4f(0.5f, 9, 9, 9)},
                  {.name = "nobody asks", .value = Vec4f::Ones()}};
    expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))), expectedOf({0.4f, 0.2f, 0.1f}));
}

TEST_F(PersonProgramTest, TwoMaterialsOfOneProgramSayTwoThings) {
    Programmed p;
    p.program.surface = "uniform vec3 tint; void surface(inout Surface s) { s.base.rgb = tint; }";
    p.program.verdict = SurfaceProgram::kGood;
    const ObjectId program = p.scene.add(p.program);
    for (const float side : {-1.0f, 1.0f}) {
        Material material = p.material;
        material.program = program;
        material.uniforms.push_back(
            p.scene.add(Uniform{.name = "tint", .value = side < 0 ? Vec4f(1, 0, 0, 0) : Vec4f(0, 1, 0, 0)}));
        p.scene.place(p.scene.add(makeSheet(1, 1), p.scene.add(material)), {0.8 * static_cast<double>(side), 0, 0});
    }
    p.scene.setDark();
    const Picture picture = draw(p.scene.take(), cameraOf(kSidePx, kSidePx));
    expectNear(pixel(picture, kSidePx / 4, kSidePx / 2), {255, 0, 0});
    expectNear(pixel(picture, 3 * kSidePx / 4, kSidePx / 2), {0, 255, 0});
}

TEST_F(PersonProgramTest, KnowsPlacesTexturesAndImages) {
    Programmed p;
    p.at = {0.25, 0, -1};
    p.program.surface =
        "uniform sampler2D map; uniform sampler2D none;\nvoid surface(inout Surface s) {\n"
        "vec3 ok = vec3(0.0);\n"
        "if (distance(worldPosition, nodePosition + vec3(0.25, 0.0, -1.0)) < 1e-4) ok.r = 1.0;\n"
        "if (distance(eyePosition, worldPosition - vec3(0.0, 0.0, 2.4)) < 1e-4 && abs(uv.x - (nodePosition.x + 0.8) / "
        "1.6) < 1e-4) ok.g = 1.0;\n"
        "if (distance(texture(map, uv), vec4(0.0, 1.0, 0.0, 1.0)) < 1e-3 && texture(none, uv1) == vec4(1.0)) ok.b = "
        "1.0;\n"
        "s.base.rgb = ok; }";
    const std::array<std::uint8_t, 4> green{0, 255, 0, 255};
    p.uniforms = {
        {.name = "map",
         .image = p.scene.addImage(
             Blob(Bytes(std::as_bytes(std::span(green)).begin(), std::as_bytes(std::span(green)).end())), 1, 1)}};
    expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))), {255, 255, 255});
}

TEST_F(PersonProgramTest, LightFallsOnWhatItSays) {
    // The same numbers from fields and from a program: metal, roughness, emission, colour.
    const auto lit = [&](bool byProgram) {
        Programmed p;
        p.material.unlit = false;
        if (byProgram)
            p.program.surface =
                "void surface(inout Surface s) { s.base.rgb = vec3(0.8, 0.5, 0.2); s.metallic = 0.6; s.roughness = "
                "0.4; s.emissive = vec3(0.0, 0.1, 0.0); }";
        else
            p.material.baseColor = {0.8f, 0.5f, 0.2f, 1};
        if (!byProgram) {
            p.material.metallic = 0.6f;
            p.material.roughness = 0.4f;
            p.material.emissive = {0, 0.1f, 0};
        }
        p.scene.addDirectionalLight({0.3, -0.4, -1}, Vec3f::Ones(), 2);
        return center(draw(p.take(), cameraOf(kSidePx, kSidePx)));
    };
    const Rgb byFields = lit(false), byProgram = lit(true);
    EXPECT_GT(byFields.r, 20);
    EXPECT_NEAR(byProgram.r, byFields.r, 2);
    EXPECT_NEAR(byProgram.g, byFields.g, 2);
    EXPECT_NEAR(byProgram.b, byFields.b, 2);
}

TEST_F(PersonProgramTest, WhatIsBadIsLoudAndWhatIsUntriedIsPlain) {
    for (const bool blended : {false, true}) {
        Programmed bad;
        bad.program = {.surface = "this is no GLSL", .verdict = SurfaceProgram::kBad};
        if (blended) bad.material.alphaMode = Material::kBlend;
        bad.material.baseColor.w() = blended ? 0.5f : 1.0f;
        const Picture picture = draw(bad.take(), cameraOf(kSidePx, kSidePx));
        int magenta = 0, black = 0;
        for (int y = 24; y < 40; ++y)
            for (int x = 24; x < 40; ++x) {
                const Rgb c = pixel(picture, x, y);
                magenta += c.r > 250 && c.g < 5 && c.b > 250;
                black += c.r < 5 && c.g < 5 && c.b < 5;
            }
        EXPECT_EQ(magenta, 128);
        EXPECT_EQ(black, 128);
    }
    TestScene scene;
    Material plain;
    plain.unlit = true;
    plain.baseColor = {0.2f, 0.6f, 0.3f, 1};
    plain.program = scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { s.base = vec4(1.0); }"});
    scene.setDark();
    scene.place(scene.add(makeSheet(1.6, 1.6), scene.add(plain)), Vec3d::Zero());
    expectNear(center(draw(scene.take(), cameraOf(kSidePx, kSidePx))), expectedOf({0.2f, 0.6f, 0.3f}));
}

// The server's compiler took it, this one does not: the rest of the picture is there all the same, and somebody says
// so.
TEST_F(PersonProgramTest, WhatThisHostRefusesIsDrawnAsWrong) {
    Programmed p;
    p.program.surface = "\nvoid surface(inout Surface s) { s.base = nowhere; }";
    p.size = 0.5;
    const Picture picture = draw(p.take(), cameraOf(kSidePx, kSidePx));
    const Rgb c = center(picture);
    EXPECT_TRUE((c.r > 250 && c.b > 250) || c.r + c.g + c.b < 5) << c;
    expectNear(pixel(picture, 2, 2), expectedOf({0, 0, 0.2f}));
    EXPECT_WORDS(renderer_->lastCounts().trouble);
}

TEST_F(PersonProgramTest, LoopsThatNeverEndEnd) {
    Programmed p;
    p.program.surface =
        "int f(int a) { while (true) { ++a; } return a; }\nvoid surface(inout Surface s) { int n = 0; for (;;) ++n; do "
        "{ ++n; } while (true); n += f(0);"
        "s.base.rgb = n <= 1030 && n >= 1024 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0); }";
    p.program.vertex = std::string(kVertexHead) + "for (;;) position.x += 0.0; }";
    expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))), {0, 255, 0});
}

TEST_F(PersonProgramTest, WhatIsNoNumberIsNothing) {
    Programmed p;
    p.program.surface =
        "uniform float zero; void surface(inout Surface s) { s.base = vec4(zero / zero, 1.0, 1.0 / zero, 1.0); "
        "s.normal = vec3(zero / zero); }";
    p.program.vertex = "uniform float zero; void vertex(inout vec3 position, inout vec3 normal) { position /= zero; }";
    expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))), {0, 255, 255});
}

TEST_F(PersonProgramTest, HolesAreHolesInPicturesIdsAndShadows) {
    for (const bool byAlpha : {false, true}) {
        Programmed p;
        p.program.surface =
            byAlpha ? "void surface(inout Surface s) { s.base = vec4(0.0, 1.0, 0.0, uv.x < 0.5 ? 0.0 : 1.0); }"
                    : "void surface(inout Surface s) { if (uv.x < 0.5) discard; s.base = vec4(0.0, 1.0, 0.0, 1.0); }";
        if (byAlpha) p.material.alphaMode = Material::kMask;
        const Aspect aspect = p.take();
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        const Picture picture = draw(aspect, camera);
        expectNear(pixel(picture, kSidePx / 2 - 4, kSidePx / 2), expectedOf({0, 0, 0.2f}));
        expectNear(pixel(picture, kSidePx / 2 + 4, kSidePx / 2), {0, 255, 0});
        const auto ids = renderer_->drawNodeIds(aspect, listOf(aspect, camera), camera, whole(camera));
        ASSERT_TRUE(ids) << ids.error().message;
        EXPECT_EQ((*ids)[static_cast<std::size_t>(kSidePx * kSidePx / 2 + kSidePx / 2 - 4)], 0u);
        EXPECT_NE((*ids)[static_cast<std::size_t>(kSidePx * kSidePx / 2 + kSidePx / 2 + 4)], 0u);
    }
    // A light from the front, a sheet with a hole before a wall.
    TestScene scene;
    scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero());
    scene.addDirectionalLight({0.5, 0, -1}, Vec3f::Ones(), 1, true);
    Material white;
    white.baseColor = Vec4f::Ones();
    Material holed = white;
    holed.program = scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { if (uv.y < 0.5) discard; }",
                                             .verdict = SurfaceProgram::kGood});
    scene.place(scene.add(makeSheet(3, 3), scene.add(white)), {0, 0, -1});
    scene.place(scene.add(makeSheet(1, 1), scene.add(holed)), {-0.6, 0, 0});
    const Picture picture = draw(scene.take(), cameraOf(kSidePx, kSidePx));
    // Where the sheet's shadow falls, a unit behind it: moved half a unit to the right, out from behind the sheet.
    const int x = kSidePx / 2 + 2;
    EXPECT_GT(pixel(picture, x, kSidePx / 2 - 5).r, 150);
    EXPECT_LT(pixel(picture, x, kSidePx / 2 + 5).r, 20);
}

TEST_F(PersonProgramTest, VerticesMoveAsFarAsTheProgramSaysAndNoFarther) {
    const auto shownAt = [&](double reach) {
        Programmed p;
        p.size = 0.4;
        p.program.vertex = "uniform float way; " + std::string(kVertexHead) + "position.x += way; }";
        p.program.reach = reach;
        p.material.emissive = Vec3f::Ones();
        p.uniforms = {{.name = "way", .value = Vec4f(0.8f, 0, 0, 0)}};
        const Picture picture = draw(p.take(), cameraOf(kSidePx, kSidePx));
        int first = -1;
        for (int x = kSidePx - 1; x >= 0; --x)
            if (pixel(picture, x, kSidePx / 2).r > 100) first = x;
        return first;
    };
    const int pixelsPerUnit = kSidePx * 10 / 32;
    EXPECT_NEAR(shownAt(0), kSidePx / 2 - pixelsPerUnit / 5, 1);
    EXPECT_NEAR(shownAt(0.4), kSidePx / 2 + pixelsPerUnit / 5, 1);
    EXPECT_NEAR(shownAt(10), kSidePx / 2 + 3 * pixelsPerUnit / 5, 1);
}

// With all that can tell tiles apart: derivatives, vertices that move, holes, places in the world, loops, several
// cells.
TEST_F(PersonProgramTest, TilesAreCutFromOnePicture) {
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        TestScene scene;
        const char* const surface =
            "uniform float zoom;\nvoid surface(inout Surface s) { vec2 c = uv * zoom; float n = 0.0; for (int i = 0; i "
            "< 20; ++i) { c = vec2(c.x * c.x - c.y * c.y, 2.0 * c.x * c.y) + uv - 0.5; n += "
            "step(dot(c, c), 4.0); }\n s.base.rgb = vec3(n / 20.0, fract(worldPosition.x * 7.0), length(fwidth(uv)) * "
            "60.0); s.base.a = fract(uv.y * 9.0); s.normal += dFdx(eyePosition) * 3.0; s.roughness = n / 30.0; if "
            "(fract(uv.x * 5.0) < "
            "0.2) discard; }";
        const std::string vertex =
            std::string(kVertexHead) +
            "position.z += 0.2 * sin(7.0 * position.x); normal = normalize(normal + vec3(0.3, 0.0, 0.0)); }";
        const ObjectId program = scene.add(
            SurfaceProgram{.surface = surface, .vertex = vertex, .reach = 0.3, .verdict = SurfaceProgram::kGood});
        const ObjectId zoom = scene.add(Uniform{.name = "zoom", .value = Vec4f::Constant(1.3f)});
        scene.setEnvironment(Vec3f(0.4f, 0.5f, 0.6f), Vec3f(0.2f, 0.1f, 0.1f), Vec3f(0.1f, 0.1f, 0.1f));
        for (int i = 0; i < 6; ++i) {
            Material material;
            material.program = program;
            material.uniforms.push_back(zoom);
            material.alphaMode = i % 3 == 0 ? Material::kAutoAlpha : i % 3 == 1 ? Material::kMask : Material::kBlend;
            scene.place(scene.add(makeSheet(1.2, 1.2), scene.add(material)), {-1.2 + 0.5 * i, 0.1 * i - 0.2, -0.3 * i},
                        Quatd(Eigen::AngleAxisd(0.5, Vec3d(1, 1, 0).normalized())));
        }
        const Aspect aspect = scene.take();
        const ScreenCamera camera = cameraOf(1200, 700);
        const Picture all = draw(aspect, camera);
        RenderScene renderScene;
        renderScene.update(aspect, nullptr);
        for (const PixelRect rect : {PixelRect{.x = 0, .y = 0, .width = 600, .height = 350},
                                     PixelRect{.x = 600, .y = 350, .width = 600, .height = 350},
                                     PixelRect{.x = 333, .y = 111, .width = 517, .height = 489}}) {
            RenderAction action(CullerKind::kMasked);
            const DrawList list = action.run(renderScene, camera, rect, nullptr);
            const auto part = renderer_->draw(aspect, list, camera, rect);
            ASSERT_TRUE(part) << part.error().message;
            int differ = 0;
            for (int y = 0; y < rect.height; ++y)
                for (int x = 0; x < rect.width; ++x) {
                    const Rgb a = pixel(*part, x, y), b = pixel(all, rect.x + x, 700 - rect.y - rect.height + y);
                    differ += a.r != b.r || a.g != b.g || a.b != b.b;
                }
            EXPECT_EQ(differ, 0) << samples << " samples, " << rect.x << "," << rect.y;
        }
    }
}

// Tiles that show other things than their neighbours, and shadows of some of them: no program is made twice.
TEST_F(PersonProgramTest, EachTextOfAFrameIsCompiledOnce) {
    for (const int count : {40, 100}) {
        restart({.samples = 1});
        TestScene scene;
        scene.setDark();
        scene.addDirectionalLight({0.1, -0.3, -1}, Vec3f::Ones(), 1, true);
        for (int i = 0; i < count; ++i) {
            Material material;
            material.program =
                scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { s.base.rgb = vec3(" +
                                                    std::to_string(i) + ".0 / 100.0, 1.0, 0.0); }",
                                         .verdict = SurfaceProgram::kGood});
            scene.place(scene.add(makeSheet(0.2, 0.2), scene.add(material)),
                        {-1.4 + 0.3 * (i % 10), -1.4 + 0.28 * (i / 10), 0});
        }
        const Aspect aspect = scene.take();
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        RenderScene renderScene;
        renderScene.update(aspect, nullptr);
        std::vector<std::uint64_t> compiled;
        for (int frame = 0; frame < 3; ++frame) {
            renderer_->beginFrame();
            for (const int x : {0, kSidePx / 2})
                for (const int y : {0, kSidePx / 2}) {
                    const PixelRect rect{.x = x, .y = y, .width = kSidePx / 2, .height = kSidePx / 2};
                    RenderAction action(CullerKind::kFrustum);
                    ASSERT_TRUE(renderer_->draw(aspect, action.run(renderScene, camera, rect, nullptr), camera, rect));
                }
            compiled.push_back(renderer_->lastCounts().compiled);
        }
        EXPECT_GE(compiled[0], static_cast<std::uint64_t>(count));
        EXPECT_EQ(compiled[1], compiled[0]) << count << " programs";
        EXPECT_EQ(compiled[2], compiled[0]) << count << " programs";
    }
}

/// Programs read flat images alone. What is none is not looked up: it would show what was drawn before, on each tile
/// another thing.
TEST_F(PersonProgramTest, WithACubeOrASolidTheMaterialIsPlain) {
    for (const std::int64_t shape : {Image::kFlat, Image::kLine, Image::kCube, Image::kSolid}) {
        Programmed p;
        p.material.baseColor = {0.2f, 0.6f, 0.3f, 1};
        p.program.surface =
            "uniform sampler2D map; void surface(inout Surface s) { s.base.rgb = texture(map, uv).rgb; }";
        std::vector<std::uint8_t> red;
        for (int i = 0; i < 6; ++i) red.insert(red.end(), {255, 0, 0, 255});
        Image image{
            .pixels = Blob::of(std::span<const std::uint8_t>(red)), .widthPx = 1, .heightPx = 1, .shape = shape};
        if (shape == Image::kFlat) image.heightPx = 6;
        if (shape == Image::kLine) image.widthPx = 6;
        if (shape == Image::kSolid) image.depthPx = 6;
        p.uniforms = {{.name = "map", .image = p.scene.add(image)}};
        // What no sampler is called after does not count.
        Image other = image;
        other.shape = Image::kCube;
        other.widthPx = other.heightPx = other.depthPx = 1;
        p.uniforms.push_back({.name = "surfaceOfAnother", .value = Vec4f::Zero(), .image = p.scene.add(other)});
        p.uniforms.push_back({.name = "texture", .value = Vec4f::Zero(), .image = p.scene.add(other)});
        const bool read = shape == Image::kFlat || shape == Image::kLine;
        expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))),
                   read ? Rgb{255, 0, 0} : expectedOf({0.2f, 0.6f, 0.3f}));
    }
}

// An editor sends a new text with every stroke.
TEST_F(PersonProgramTest, TextsAreForgottenAgain) {
    std::uint64_t programs = 0;
    for (int i = 0; i < 40; ++i) {
        Programmed p;
        p.program.surface = "void surface(inout Surface s) { s.base.rgb = vec3(" + std::to_string(i) +
                            ".0 / 100.0, 0.0, 0.0); }// " + std::to_string(i);
        p.size = 0.8;
        const Aspect aspect = p.take();
        const ScreenCamera camera = cameraOf(16, 16);
        expectNear(center(draw(aspect, camera)), expectedOf({static_cast<float>(i) / 100, 0, 0}));
        programs = std::max(programs, renderer_->lastCounts().programs);
    }
    // Two or more of each text, and those of light.
    EXPECT_LT(programs, 80u);
}

// Each time that a picture may be another one by what became of programs; not when their texts are forgotten, as nobody
// draws with them then.
TEST(PersonPrograms, CountVerdicts) {
    TestScene scene;
    std::vector<ObjectId> programs, materials;
    for (std::size_t i = 0; i < 2 * PersonPrograms::kKept; ++i) {
        programs.push_back(scene.add(SurfaceProgram{
            .surface = "void surface(inout Surface s) {}// " + std::to_string(i), .verdict = SurfaceProgram::kGood}));
        materials.push_back(scene.add(Material{.program = programs.back()}));
    }
    Aspect aspect = scene.take();
    PersonPrograms persons;
    const auto find = [&](std::size_t i) { return persons.find(aspect, *aspect.get<Material>(materials[i])); };
    std::size_t gone = 0;
    for (std::size_t i = 0; i < materials.size(); ++i) {
        persons.beginFrame();
        persons.beginDraw();
        EXPECT_GT(find(i).drawn, PersonPrograms::kError);
        gone += persons.forgetUnused().size();
    }
    EXPECT_GT(gone, 100u);
    EXPECT_GT(persons.changes(), 0u) << "numbers of before mean nothing any more";
    EXPECT_EQ(persons.verdicts(), 0u);
    const std::size_t last = materials.size() - 1;
    persons.refused(find(last - 1).known, "surface, line 1: no");
    EXPECT_EQ(persons.verdicts(), 1u);
    persons.holdsUp(find(last).known, std::chrono::milliseconds(600));
    EXPECT_EQ(persons.verdicts(), 2u);
    EXPECT_EQ(persons.heldUpBy(aspect).size(), 1u);
    EXPECT_EQ(persons.verdicts(), 2u);
    ChangeListBuilder edit;
    setField<&SurfaceProgram::verdict>(edit, programs[last], SurfaceProgram::kHeavy);
    ASSERT_TRUE(aspect.apply(edit.take()));
    EXPECT_TRUE(persons.heldUpBy(aspect).empty());
    EXPECT_EQ(persons.verdicts(), 3u);
}

}  // namespace
}  // namespace tessera
