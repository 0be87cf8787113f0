// Programs of persons that take too long: left out, named, and nobody else with them.
#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <ctime>
#include <filesystem>
#include <thread>

#include "tests/unit/draw/ProgramStage.h"

namespace tessera {
namespace {

/// Nothing at 0 and 1, without an end at 2: drawn as the material says, and named. Solid, blended, and by its vertices.
TEST_F(PersonProgramTest, WhatTakesTooLongIsLeftOutAndNamed) {
    const std::string dear =
        "uniform float rounds;\nfloat spin(float n) { for (int i = 0; i < 1000 && float(i) < (rounds - 1.0) * 1000.0; "
        "++i) {"
        " n = fract(sin(n * 12.9898 + float(i)) * 43758.5453 + pow(abs(cos(n)), 1.7) + exp(-n) + log(2.0 + n * n) + "
        "atan(n, 2.0) + inversesqrt(1.0 + n));"
        " n = fract(sin(n * 3.1 + 0.3) * 4375.5453 + pow(abs(cos(n)), 1.3) + exp(-n) + log(2.5 + n * n) + atan(n, 3.0) "
        "+ inversesqrt(2.0 + n)); } return n; }\n";
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
                p.program.surface =
                    dear + "void surface(inout Surface s) { s.base.rgb = vec3(0.9, 0.1 + 1e-3 * spin(uv.x), 0.1); }";
            }
            const ObjectId program = p.scene.add(p.program),
                           harmless =
                               p.scene.add(SurfaceProgram{.surface = "void surface(inout Surface s) { for (int i = 0; "
                                                                     "i < 3; ++i) s.base.rgb = vec3(0.0, 0.0, 0.5); }",
                                                          .verdict = SurfaceProgram::kGood});
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
                    fine.positions.insert(fine.positions.end(), {static_cast<float>(2.0 * x / side - 1),
                                                                 static_cast<float>(2.0 * y / side - 1), 0});
                    fine.normals.insert(fine.normals.end(), {0, 0, 1});
                    fine.texcoords.insert(fine.texcoords.end(), {static_cast<float>(x) / static_cast<float>(side),
                                                                 static_cast<float>(y) / static_cast<float>(side)});
                    if (x == side || y == side) continue;
                    const auto corner = static_cast<std::uint32_t>(y * (side + 1) + x),
                               above = corner + static_cast<std::uint32_t>(side) + 1;
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
            edit([&](ChangeListBuilder& list) {
                setField<&SurfaceProgram::verdict>(list, program, SurfaceProgram::kHeavy);
            });
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

/// Two sheets over a floor, of two programs with one text, which lifts them, and with them their shadows. Once one of
/// the two says something else, before anything is drawn, the text is tried again: for the other one, and for its
/// shadow.
TEST_F(PersonProgramTest, WhatIsDrawnWithAgainCastsItsShadowAgain) {
    restart({.samples = 1, .programsMost = std::chrono::milliseconds(400)});
    TestScene scene;
    SurfaceProgram program;
    program.verdict = SurfaceProgram::kGood;
    program.reach = 3;
    program.vertex = std::string(kVertexHead) + "position.y += 0.7; }";
    program.surface =
        "uniform float rounds;\nvoid surface(inout Surface s) { float n = uv.x; for (int i = 0; i < 5000 && float(i) < "
        "rounds; ++i) { n = fract(sin(n * 12.9898 + float(i)) * 43758.5453 + pow(abs(cos(n)), 1.7) + exp(-n) + log(2.0 "
        "+ n * n) + atan(n, 2.0) + inversesqrt(1.0 + n)); n = fract(sin(n * 3.1 + 0.3) * 4375.5453 + pow(abs(cos(n)), "
        "1.3) + exp(-n) + log(2.5 + n * n) + atan(n, 3.0)); } s.base.rgb = vec3(0.9, 0.1 + 1e-3 * n, 0.1); }";
    const ObjectId rounds = scene.add(Uniform{.name = "rounds", .value = Vec4f(5000, 0, 0, 0)});
    std::vector<ObjectId> programs;
    for (const double x : {-0.8, 0.8}) {
        programs.push_back(scene.add(program));
        Material material;
        material.program = programs.back();
        material.uniforms.push_back(rounds);
        scene.place(scene.add(makeSheet(1.4, 1.4), scene.add(material)), {x, -0.2, 0});
    }
    scene.place(scene.add(makeBox({8, 0.2, 6})), {0, -1.1, -1});
    scene.addDirectionalLight({0.1, -1, -0.5}, Vec3f::Ones(), 1, true);
    Aspect aspect = scene.take();
    RenderScene all;
    all.update(aspect, nullptr);
    const ScreenCamera camera = cameraOf(400, 300);
    const auto look = [&](Renderer& renderer, const RenderScene& of) {
        RenderAction action(CullerKind::kNone);
        return renderer.draw(aspect, action.run(of, camera, whole(camera), nullptr), camera, whole(camera)).value();
    };
    const Picture held = look(*renderer_, all);
    ASSERT_EQ(renderer_->heldUpBy(aspect).size(), 1u);
    const std::uint64_t before = renderer_->programChanges();
    ChangeListBuilder edit;
    setField<&Uniform::value>(edit, rounds, Vec4f(0, 0, 0, 0));
    // The one that stands for both.
    setField<&SurfaceProgram::surface>(edit, renderer_->heldUpBy(aspect)[0].program,
                                       std::string("void surface(inout Surface s) { s.base.rgb = vec3(0.2); }"));
    const ChangeList list = edit.take();
    ASSERT_TRUE(aspect.apply(list));
    all.update(aspect, &list);
    EXPECT_TRUE(renderer_->heldUpBy(aspect).empty());
    EXPECT_NE(renderer_->programChanges(), before) << "pictures of before lack it";
    const Picture again = look(*renderer_, all);
    EXPECT_TRUE(renderer_->heldUpBy(aspect).empty());
    restart({.samples = 1});
    RenderScene fresh;
    fresh.update(aspect, nullptr);
    EXPECT_EQ(again, look(*renderer_, fresh));
    EXPECT_NE(again, held);
}

/// A sheet whose program goes so many rounds for each pixel, and what is drawn where it is left out.
Aspect takesLong(int rounds) {
    Programmed p;
    p.material.baseColor = {0, 1, 0, 1};
    p.program.surface = "void surface(inout Surface s) { float n = uv.x; for (int i = 0; i < " +
                        std::to_string(rounds) +
                        "; ++i) n = fract(sin(n * 12.9898) * 43758.5453 + pow(abs(cos(n)), 1.7)); s.base.rgb = "
                        "vec3(0.8 + 1e-3 * n, 0.0, 0.0); }";
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
        for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task"))
            ::sched_setaffinity(std::atoi(entry.path().filename().c_str()), sizeof set, &set);
    }
    cpu_set_t before_{};
};

/// As many rounds as make a picture take about so long on one processor.
class WatchedTest : public PersonProgramTest {
protected:
    static constexpr std::chrono::milliseconds kTakes{30};
    static Picture drawWith(Renderer& renderer, const Aspect& aspect, const DrawList& list,
                            const ScreenCamera& camera) {
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

/// Beside eight threads of the same process that want its processor, too, a picture takes nine times as long: that is
/// not the program's fault.
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
    for (int i = 0; i < 24; ++i)
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
        programs.push_back(scene.add(
            SurfaceProgram{.surface = "void surface(inout Surface s) { float n = uv.x; for (int i = 0; i < " + rounds +
                                      "; ++i) for (int k = 0; k < " + rounds + "; ++k) { n = fract(sin(n * 12.9898 + " +
                                      std::to_string(i) +
                                      ".0) * 43758.5453 + pow(abs(cos(n)), 1.7)); n = fract(exp(n) + atan(n, 3.0) + "
                                      "log(2.0 + n)); n = fract(pow(n + 0.1, 1.3) + sin(n * 7.0)); } s.base.rgb = "
                                      "vec3(0.8 + 1e-3 * n, 0.0, 0.0); }",
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
        material.program = scene.add(
            SurfaceProgram{.surface = "void surface(inout Surface s) { float n = uv.x; for (int i = 0; i < 2000; ++i) "
                                      "for (int k = 0; k < 2000; ++k) "
                                      "{ n = fract(sin(n * 12.9898 + " +
                                      std::to_string(i) +
                                      ".0) * 43758.5453 + pow(abs(cos(n)), 1.7)); n = fract(exp(n) + atan(n, 3.0)); } "
                                      "s.base.rgb = vec3(0.8 + 1e-3 * n, 0.0, 0.0); }",
                           .verdict = SurfaceProgram::kGood});
        scene.place(scene.add(makeSheet(0.25, 1.6), scene.add(material)), {-1.35 + 0.3 * i, 0, 0});
    }
    const Aspect aspect = scene.take();
    const Picture picture = draw(aspect, cameraOf(400, 400));
    EXPECT_EQ(renderer_->heldUpBy(aspect).size(), 10u);
    EXPECT_GT(pixel(picture, 181, 200).g, 200);
}

}  // namespace
}  // namespace tessera
