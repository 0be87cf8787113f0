// Programs of persons, in every pass that draws a surface.
#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <ctime>
#include <filesystem>
#include <thread>

#include "common/scene/Edits.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

const char* const kVertexHead = "void vertex(inout vec3 position, inout vec3 normal) { ";

/// A sheet with a program, unlit unless said otherwise.
struct Programmed {
    TestScene scene;
    Material material{};
    SurfaceProgram program{};
    std::vector<Uniform> uniforms{};
    double size = 1.6;
    Vec3d at = Vec3d::Zero();

    Programmed() { material.unlit = true; }
    Aspect take() {
        program.verdict = program.verdict == SurfaceProgram::kUntried ? SurfaceProgram::kGood : program.verdict;
        material.program = scene.add(program);
        for (const Uniform& uniform : uniforms) material.uniforms.push_back(scene.add(uniform));
        scene.setDark(Vec3f(0, 0, 0.2f));
        scene.place(scene.add(makeSheet(size, size), scene.add(material)), at);
        return scene.take();
    }
};

class PersonProgramTest : public RendererTest {};

TEST_F(PersonProgramTest, SaysTheColourByItsUniforms) {
    Programmed p;
    p.program.surface = "uniform vec3 tint;\nuniform float half_;\nuniform vec2 unsaid;\nvoid surface(inout Surface s) { s.base.rgb = tint * half_ + vec3(unsaid, 0.0); }";
    p.uniforms = {{.name = "tint", .value = Vec4f(0.8f, 0.4f, 0.2f, 9)}, {.name = "half_", .value = Vec4f(0.5f, 9, 9, 9)}, {.name = "nobody asks", .value = Vec4f::Ones()}};
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
        material.uniforms.push_back(p.scene.add(Uniform{.name = "tint", .value = side < 0 ? Vec4f(1, 0, 0, 0) : Vec4f(0, 1, 0, 0)}));
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
    p.program.surface = "uniform sampler2D map; uniform sampler2D none;\nvoid surface(inout Surface s) {\n"
                        "vec3 ok = vec3(0.0);\n"
                        "if (distance(worldPosition, nodePosition + vec3(0.25, 0.0, -1.0)) < 1e-4) ok.r = 1.0;\n"
                        "if (distance(eyePosition, worldPosition - vec3(0.0, 0.0, 2.4)) < 1e-4 && abs(uv.x - (nodePosition.x + 0.8) / 1.6) < 1e-4) ok.g = 1.0;\n"
                        "if (distance(texture(map, uv), vec4(0.0, 1.0, 0.0, 1.0)) < 1e-3 && texture(none, uv1) == vec4(1.0)) ok.b = 1.0;\n"
                        "s.base.rgb = ok; }";
    const std::array<std::uint8_t, 4> green{0, 255, 0, 255};
    p.uniforms = {{.name = "map", .image = p.scene.addImage(Blob(Bytes(std::as_bytes(std::span(green)).begin(), std::as_bytes(std::span(green)).end())), 1, 1)}};
    expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))), {255, 255, 255});
}

TEST_F(PersonProgramTest, LightFallsOnWhatItSays) {
    // The same numbers from fields and from a program: metal, roughness, emission, colour.
    const auto lit = [&](bool byProgram) {
        Programmed p;
        p.material.unlit = false;
        if (byProgram)
            p.program.surface = "void surface(inout Surface s) { s.base.rgb = vec3(0.8, 0.5, 0.2); s.metallic = 0.6; s.roughness = 0.4; s.emissive = vec3(0.0, 0.1, 0.0); }";
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

// The server's compiler took it, this one does not: the rest of the picture is there all the same, and somebody says so.
TEST_F(PersonProgramTest, WhatThisHostRefusesIsDrawnAsWrong) {
    Programmed p;
    p.program.surface = "\nvoid surface(inout Surface s) { s.base = nowhere; }";
    p.size = 0.5;
    const Picture picture = draw(p.take(), cameraOf(kSidePx, kSidePx));
    const Rgb c = center(picture);
    EXPECT_TRUE((c.r > 250 && c.b > 250) || c.r + c.g + c.b < 5) << c;
    expectNear(pixel(picture, 2, 2), expectedOf({0, 0, 0.2f}));
    EXPECT_NE(renderer_->lastCounts().trouble.find("surface, line 2"), std::string::npos) << renderer_->lastCounts().trouble;
}

TEST_F(PersonProgramTest, LoopsThatNeverEndEnd) {
    Programmed p;
    p.program.surface = "int f(int a) { while (true) { ++a; } return a; }\nvoid surface(inout Surface s) { int n = 0; for (;;) ++n; do { ++n; } while (true); n += f(0);"
                        "s.base.rgb = n <= 1030 && n >= 1024 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0); }";
    p.program.vertex = std::string(kVertexHead) + "for (;;) position.x += 0.0; }";
    expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))), {0, 255, 0});
}

TEST_F(PersonProgramTest, WhatIsNoNumberIsNothing) {
    Programmed p;
    p.program.surface = "uniform float zero; void surface(inout Surface s) { s.base = vec4(zero / zero, 1.0, 1.0 / zero, 1.0); s.normal = vec3(zero / zero); }";
    p.program.vertex = "uniform float zero; void vertex(inout vec3 position, inout vec3 normal) { position /= zero; }";
    expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))), {0, 255, 255});
}

TEST_F(PersonProgramTest, HolesAreHolesInPicturesIdsAndShadows) {
    for (const bool byAlpha : {false, true}) {
        Programmed p;
        p.program.surface = byAlpha ? "void surface(inout Surface s) { s.base = vec4(0.0, 1.0, 0.0, uv.x < 0.5 ? 0.0 : 1.0); }"
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
    holed.program = scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { if (uv.y < 0.5) discard; }", .verdict = SurfaceProgram::kGood});
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

// With all that can tell tiles apart: derivatives, vertices that move, holes, places in the world, loops, several cells.
TEST_F(PersonProgramTest, TilesAreCutFromOnePicture) {
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        TestScene scene;
        const char* const surface =
            "uniform float zoom;\nvoid surface(inout Surface s) { vec2 c = uv * zoom; float n = 0.0; for (int i = 0; i < 20; ++i) { c = vec2(c.x * c.x - c.y * c.y, 2.0 * c.x * c.y) + uv - 0.5; n += "
            "step(dot(c, c), 4.0); }\n s.base.rgb = vec3(n / 20.0, fract(worldPosition.x * 7.0), length(fwidth(uv)) * 60.0); s.base.a = fract(uv.y * 9.0); s.normal += dFdx(eyePosition) * 3.0; s.roughness = n / 30.0; if (fract(uv.x * 5.0) < "
            "0.2) discard; }";
        const std::string vertex = std::string(kVertexHead) + "position.z += 0.2 * sin(7.0 * position.x); normal = normalize(normal + vec3(0.3, 0.0, 0.0)); }";
        const ObjectId program = scene.add(SurfaceProgram{.surface = surface, .vertex = vertex, .reach = 0.3, .verdict = SurfaceProgram::kGood});
        const ObjectId zoom = scene.add(Uniform{.name = "zoom", .value = Vec4f::Constant(1.3f)});
        scene.setEnvironment(Vec3f(0.4f, 0.5f, 0.6f), Vec3f(0.2f, 0.1f, 0.1f), Vec3f(0.1f, 0.1f, 0.1f));
        for (int i = 0; i < 6; ++i) {
            Material material;
            material.program = program;
            material.uniforms.push_back(zoom);
            material.alphaMode = i % 3 == 0 ? Material::kAutoAlpha : i % 3 == 1 ? Material::kMask : Material::kBlend;
            scene.place(scene.add(makeSheet(1.2, 1.2), scene.add(material)), {-1.2 + 0.5 * i, 0.1 * i - 0.2, -0.3 * i}, Quatd(Eigen::AngleAxisd(0.5, Vec3d(1, 1, 0).normalized())));
        }
        const Aspect aspect = scene.take();
        const ScreenCamera camera = cameraOf(1200, 700);
        const Picture all = draw(aspect, camera);
        RenderScene renderScene;
        renderScene.update(aspect, nullptr);
        for (const PixelRect rect : {PixelRect{.x = 0, .y = 0, .width = 600, .height = 350}, PixelRect{.x = 600, .y = 350, .width = 600, .height = 350}, PixelRect{.x = 333, .y = 111, .width = 517, .height = 489}}) {
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
            material.program = scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { s.base.rgb = vec3(" + std::to_string(i) + ".0 / 100.0, 1.0, 0.0); }", .verdict = SurfaceProgram::kGood});
            scene.place(scene.add(makeSheet(0.2, 0.2), scene.add(material)), {-1.4 + 0.3 * (i % 10), -1.4 + 0.28 * (i / 10), 0});
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

/// Nothing at 0 and 1, without an end at 2: drawn as the material says, and named. Solid, blended, and by its vertices.
TEST_F(PersonProgramTest, WhatTakesTooLongIsLeftOutAndNamed) {
    const std::string dear = "uniform float rounds;\nfloat spin(float n) { for (int i = 0; i < 1000 && float(i) < (rounds - 1.0) * 1000.0; ++i) {"
                             " n = fract(sin(n * 12.9898 + float(i)) * 43758.5453 + pow(abs(cos(n)), 1.7) + exp(-n) + log(2.0 + n * n) + atan(n, 2.0) + inversesqrt(1.0 + n));"
                             " n = fract(sin(n * 3.1 + 0.3) * 4375.5453 + pow(abs(cos(n)), 1.3) + exp(-n) + log(2.5 + n * n) + atan(n, 3.0) + inversesqrt(2.0 + n)); } return n; }\n";
    for (const bool byVertex : {false, true})
        for (const std::int64_t alpha : {Material::kOpaque, Material::kBlend}) {
            restart({.samples = 1, .programsMost = std::chrono::milliseconds(100)});
            Programmed p;
            p.material.baseColor = {0.2f, 0.6f, 0.3f, 1};
            p.material.alphaMode = alpha;
            p.program.verdict = SurfaceProgram::kGood;
            const std::string surface = "void surface(inout Surface s) { s.base.rgb = vec3(0.9, 0.1, 0.1); }";
            if (byVertex) {
                p.program.surface = surface;
                p.program.vertex = dear + kVertexHead + "position.z += 1e-3 * spin(position.x); }";
            } else {
                p.program.surface = dear + "void surface(inout Surface s) { s.base.rgb = vec3(0.9, 0.1 + 1e-3 * spin(uv.x), 0.1); }";
            }
            const ObjectId program = p.scene.add(p.program), harmless = p.scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { for (int i = 0; i < 3; ++i) s.base.rgb = vec3(0.0, 0.0, 0.5); }", .verdict = SurfaceProgram::kGood});
            const ObjectId rounds = p.scene.add(Uniform{.name = "rounds", .value = Vec4f(1, 0, 0, 0)});
            p.material.program = program;
            p.material.uniforms.push_back(rounds);
            Material other = p.material;
            other.program = harmless;
            other.uniforms.clear();
            p.scene.setDark();
            // As many vertices as take long.
            MeshData fine;
            const int side = byVertex ? 120 : 1;
            for (int y = 0; y <= side; ++y)
                for (int x = 0; x <= side; ++x) {
                    fine.positions.insert(fine.positions.end(), {static_cast<float>(2.0 * x / side - 1), static_cast<float>(2.0 * y / side - 1), 0});
                    fine.normals.insert(fine.normals.end(), {0, 0, 1});
                    fine.texcoords.insert(fine.texcoords.end(), {static_cast<float>(x) / static_cast<float>(side), static_cast<float>(y) / static_cast<float>(side)});
                    if (x == side || y == side) continue;
                    const auto corner = static_cast<std::uint32_t>(y * (side + 1) + x), above = corner + static_cast<std::uint32_t>(side) + 1;
                    fine.indices.insert(fine.indices.end(), {corner, corner + 1, above + 1, corner, above + 1, above});
                }
            p.scene.place(p.scene.add(fine, p.scene.add(p.material)), Vec3d::Zero());
            p.scene.place(p.scene.add(makeSheet(0.4, 0.4), p.scene.add(other)), {1.3, 0, 0.1});
            Aspect aspect = p.scene.take();
            const ScreenCamera camera = cameraOf(400, 300);
            const auto middle = [](const Picture& picture) { return pixel(picture, 200, 150); };
            EXPECT_GT(middle(draw(aspect, camera)).r, 200) << "cheap";
            EXPECT_TRUE(renderer_->heldUpBy(aspect).empty());
            const auto edit = [&](auto&& say) {
                ChangeListBuilder list;
                say(list);
                ASSERT_TRUE(aspect.apply(list.take()));
            };
            edit([&](ChangeListBuilder& list) { setField<&Uniform::value>(list, rounds, Vec4f(2, 0, 0, 0)); });
            const Picture held = draw(aspect, camera);
            expectNear(middle(held), expectedOf({0.2f, 0.6f, 0.3f}));
            expectNear(pixel(held, 362, 150), expectedOf({0, 0, 0.5f}));
            ASSERT_EQ(renderer_->heldUpBy(aspect).size(), 1u);
            EXPECT_EQ(renderer_->heldUpBy(aspect)[0].program, program);
            EXPECT_EQ(draw(aspect, camera).rgb, held.rgb);
            // The server says so, to all; then the text is said again, with something harmless.
            edit([&](ChangeListBuilder& list) { setField<&SurfaceProgram::verdict>(list, program, SurfaceProgram::kHeavy); });
            EXPECT_EQ(draw(aspect, camera).rgb, held.rgb);
            EXPECT_TRUE(renderer_->heldUpBy(aspect).empty()) << "it is known";
            edit([&](ChangeListBuilder& list) {
                setField<&SurfaceProgram::verdict>(list, program, SurfaceProgram::kGood);
                setField<&Uniform::value>(list, rounds, Vec4f(1, 0, 0, 0));
            });
            EXPECT_GT(middle(draw(aspect, camera)).r, 200) << "again";
            EXPECT_TRUE(renderer_->heldUpBy(aspect).empty());
        }
}

/// A sheet whose program goes so many rounds for each pixel, and what is drawn where it is left out.
Aspect takesLong(int rounds) {
    Programmed p;
    p.material.baseColor = {0, 1, 0, 1};
    p.program.surface = "void surface(inout Surface s) { float n = uv.x; for (int i = 0; i < " + std::to_string(rounds) +
                        "; ++i) n = fract(sin(n * 12.9898) * 43758.5453 + pow(abs(cos(n)), 1.7)); s.base.rgb = vec3(0.8 + 1e-3 * n, 0.0, 0.0); }";
    return p.take();
}

Duration timeOf(clockid_t clock) {
    timespec now{};
    ::clock_gettime(clock, &now);
    return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

/// All threads of this process on one processor, until it goes.
class OnOneProcessor {
public:
    OnOneProcessor() {
        ::sched_getaffinity(0, sizeof before_, &before_);
        cpu_set_t one;
        CPU_ZERO(&one);
        for (int i = 0; i < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++i)
            if (CPU_ISSET(i, &before_)) CPU_SET(i, &one);
        setAll(one);
    }
    ~OnOneProcessor() { setAll(before_); }
    OnOneProcessor(const OnOneProcessor&) = delete;
    OnOneProcessor& operator=(const OnOneProcessor&) = delete;

private:
    static void setAll(const cpu_set_t& set) {
        for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) ::sched_setaffinity(std::atoi(entry.path().filename().c_str()), sizeof set, &set);
    }
    cpu_set_t before_{};
};

/// As many rounds as make a picture take about so long on one processor.
class WatchedTest : public PersonProgramTest {
protected:
    static constexpr std::chrono::milliseconds kTakes{30};
    static Picture drawWith(Renderer& renderer, const Aspect& aspect, const DrawList& list, const ScreenCamera& camera) {
        auto picture = renderer.draw(aspect, list, camera, whole(camera));
        EXPECT_TRUE(picture);
        return std::move(*picture);
    }
    /// Also what it takes.
    Aspect calibrated(const ScreenCamera& camera, Duration& takes) {
        restart({.samples = 1, .programsMost = std::chrono::milliseconds(0)});
        for (int rounds = 50;; rounds *= 2) {
            Aspect aspect = takesLong(rounds);
            const DrawList list = listOf(aspect, camera);
            (void)drawWith(*renderer_, aspect, list, camera);
            const Duration before = timeOf(CLOCK_PROCESS_CPUTIME_ID);
            (void)drawWith(*renderer_, aspect, list, camera);
            takes = timeOf(CLOCK_PROCESS_CPUTIME_ID) - before;
            if (takes >= kTakes) return aspect;
        }
    }
};

/// Beside eight threads of the same process that want its processor, too, a picture takes nine times as long: that is not the program's fault.
TEST_F(WatchedTest, WhatOthersOfThisProcessTakeIsNoTimeOfAProgram) {
    const OnOneProcessor one;
    const ScreenCamera camera = cameraOf(200, 150);
    Duration takes{};
    const Aspect aspect = calibrated(camera, takes);
    restart({.samples = 1, .programsMost = std::chrono::duration_cast<std::chrono::milliseconds>(4 * takes)});
    const DrawList list = listOf(aspect, camera);
    (void)drawWith(*renderer_, aspect, list, camera);
    std::atomic<bool> ends = false;
    std::vector<std::jthread> busy;
    for (int i = 0; i < 8; ++i)
        busy.emplace_back([&ends] {
            while (!ends) {
            }
        });
    const TimePoint begun = clockNow();
    const Picture picture = drawWith(*renderer_, aspect, list, camera);
    const Duration took = clockNow() - begun;
    ends = true;
    busy.clear();
    EXPECT_GT(took, 4 * takes) << "or nothing is shown here";
    EXPECT_TRUE(renderer_->heldUpBy(aspect).empty());
    EXPECT_GT(center(picture).r, 200);
}

/// Parts of neighbours' pictures are drawn between two frames of one's own: what a program takes of them is theirs.
TEST_F(WatchedTest, WhatIsDrawnForOthersIsNoTimeOfThisFrame) {
    const ScreenCamera camera = cameraOf(200, 150);
    Duration takes{};
    const Aspect aspect = calibrated(camera, takes);
    restart({.samples = 1, .programsMost = std::chrono::duration_cast<std::chrono::milliseconds>(4 * takes)});
    const DrawList list = listOf(aspect, camera);
    (void)drawWith(*renderer_, aspect, list, camera);
    renderer_->beginFrame();
    (void)drawWith(*renderer_, aspect, list, camera);
    for (int part = 0; part < 12; ++part) {
        const auto drawn = renderer_->drawWhileWanted(aspect, list, camera, whole(camera), [] { return false; });
        ASSERT_TRUE(drawn && *drawn);
        EXPECT_GT(center(**drawn).r, 200) << part;
    }
    EXPECT_TRUE(renderer_->heldUpBy(aspect).empty());
}

/// A machine that has no thread more draws all the same.
TEST_F(WatchedTest, WithoutAThreadNothingIsWatched) {
    Duration takes{};
    const ScreenCamera camera = cameraOf(200, 150);
    const Aspect aspect = calibrated(camera, takes);
    restart({.samples = 1, .programsMost = std::chrono::milliseconds(10'000)});
    pthread_attr_t before, huge;
    ASSERT_EQ(::pthread_getattr_default_np(&before), 0);
    ASSERT_EQ(::pthread_getattr_default_np(&huge), 0);
    ASSERT_EQ(::pthread_attr_setstacksize(&huge, std::size_t{1} << 46u), 0);
    ASSERT_EQ(::pthread_setattr_default_np(&huge), 0);
    const auto picture = renderer_->draw(aspect, listOf(aspect, camera), camera, whole(camera));
    ASSERT_EQ(::pthread_setattr_default_np(&before), 0);
    ::pthread_attr_destroy(&huge);
    ::pthread_attr_destroy(&before);
    ASSERT_TRUE(picture);
    EXPECT_GT(center(*picture).r, 200);
}

/// Where one of several was too slow nobody else is named.
TEST_F(PersonProgramTest, AmongManyTheOneThatTakesLongIsNamed) {
    restart({.samples = 1, .programsMost = std::chrono::milliseconds(40)});
    TestScene scene;
    scene.setDark();
    std::vector<ObjectId> programs;
    for (int i = 0; i < 5; ++i) {
        Material material;
        material.unlit = true;
        material.baseColor = {0, 1, 0, 1};
        const std::string rounds = i == 2 ? "1000" : "1";
        programs.push_back(scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { float n = uv.x; for (int i = 0; i < " + rounds + "; ++i) for (int k = 0; k < " + rounds +
                                                               "; ++k) { n = fract(sin(n * 12.9898 + " + std::to_string(i) + ".0) * 43758.5453 + pow(abs(cos(n)), 1.7)); n = fract(exp(n) + atan(n, 3.0) + "
                                                               "log(2.0 + n)); n = fract(pow(n + 0.1, 1.3) + sin(n * 7.0)); } s.base.rgb = vec3(0.8 + 1e-3 * n, 0.0, 0.0); }",
                                                    .verdict = SurfaceProgram::kGood}));
        material.program = programs.back();
        scene.place(scene.add(makeSheet(0.5, 1.6), scene.add(material)), {-1.2 + 0.6 * i, 0, 0});
    }
    const Aspect aspect = scene.take();
    const ScreenCamera camera = cameraOf(400, 400);
    const Picture picture = draw(aspect, camera);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(pixel(picture, 50 + 75 * i, 200).g > 200, i == 2) << i;
    ASSERT_EQ(renderer_->heldUpBy(aspect).size(), 1u);
    EXPECT_EQ(renderer_->heldUpBy(aspect)[0].program, programs[2]);
}

/// A frame has an end, however many there are: then all that have loops are left away, and say so.
TEST_F(PersonProgramTest, WhereManyTakeLongAllWithLoopsAreHeldUpAfterAFewTries) {
    restart({.samples = 1, .programsMost = std::chrono::milliseconds(20)});
    TestScene scene;
    scene.setDark();
    for (int i = 0; i < 10; ++i) {
        Material material;
        material.unlit = true;
        material.baseColor = {0, 1, 0, 1};
        material.program = scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { float n = uv.x; for (int i = 0; i < 2000; ++i) for (int k = 0; k < 2000; ++k) "
                                                               "{ n = fract(sin(n * 12.9898 + " + std::to_string(i) + ".0) * 43758.5453 + pow(abs(cos(n)), 1.7)); n = fract(exp(n) + atan(n, 3.0)); } "
                                                               "s.base.rgb = vec3(0.8 + 1e-3 * n, 0.0, 0.0); }",
                                                    .verdict = SurfaceProgram::kGood});
        scene.place(scene.add(makeSheet(0.25, 1.6), scene.add(material)), {-1.35 + 0.3 * i, 0, 0});
    }
    const Aspect aspect = scene.take();
    const Picture picture = draw(aspect, cameraOf(400, 400));
    EXPECT_EQ(renderer_->heldUpBy(aspect).size(), 10u);
    EXPECT_GT(pixel(picture, 181, 200).g, 200);
}

/// Programs read flat images alone. What is none is not looked up: it would show what was drawn before, on each tile another thing.
TEST_F(PersonProgramTest, WithACubeOrASolidTheMaterialIsPlain) {
    for (const std::int64_t shape : {Image::kFlat, Image::kLine, Image::kCube, Image::kSolid}) {
        Programmed p;
        p.material.baseColor = {0.2f, 0.6f, 0.3f, 1};
        p.program.surface = "uniform sampler2D map; void surface(inout Surface s) { s.base.rgb = texture(map, uv).rgb; }";
        std::vector<std::uint8_t> red;
        for (int i = 0; i < 6; ++i) red.insert(red.end(), {255, 0, 0, 255});
        Image image{.pixels = Blob::of(std::span<const std::uint8_t>(red)), .widthPx = 1, .heightPx = 1, .shape = shape};
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
        expectNear(center(draw(p.take(), cameraOf(kSidePx, kSidePx))), read ? Rgb{255, 0, 0} : expectedOf({0.2f, 0.6f, 0.3f}));
    }
}

// An editor sends a new text with every stroke.
TEST_F(PersonProgramTest, TextsAreForgottenAgain) {
    std::uint64_t programs = 0;
    for (int i = 0; i < 40; ++i) {
        Programmed p;
        p.program.surface = "void surface(inout Surface s) { s.base.rgb = vec3(" + std::to_string(i) + ".0 / 100.0, 0.0, 0.0); }// " + std::to_string(i);
        p.size = 0.8;
        const Aspect aspect = p.take();
        const ScreenCamera camera = cameraOf(16, 16);
        expectNear(center(draw(aspect, camera)), expectedOf({static_cast<float>(i) / 100, 0, 0}));
        programs = std::max(programs, renderer_->lastCounts().programs);
    }
    // Two or more of each text, and those of light.
    EXPECT_LT(programs, 80u);
}

}  // namespace
}  // namespace tessera
