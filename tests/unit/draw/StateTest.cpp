// What a call leaves in GL is nothing: pictures do not depend on what was drawn, read or uploaded before.
#include <map>
#include <random>

#include "common/drawable/ImageLayout.h"
#include "tests/unit/draw/VolumeStage.h"

namespace tessera {
namespace {

/// A sky of blocks, each of one colour and another one than its neighbours: flat, or a cube.
Image blockSky(std::int64_t encoding, bool cube) {
    std::mt19937 random(7);
    Image image{.widthPx = cube ? 16 : 32,
                .heightPx = 16,
                .encoding = encoding,
                .shape = cube ? Image::kCube : Image::kFlat,
                .mipmaps = 1};
    std::vector<std::uint8_t> bytes(levelsOf(image).back().offset + levelsOf(image).back().sizeBytes);
    for (std::size_t at = 0; at < bytes.size(); at += 16) {
        // bc6h, mode 11: ends of ten bits a channel, alike. bc7, mode 5: ends of seven bits a channel, alike, and full
        // alpha.
        const bool halves = encoding == Image::kBc6h;
        std::size_t bit = 8 * at;
        const auto put = [&](unsigned value, int bits) {
            for (int i = 0; i < bits; ++i, ++bit)
                bytes[bit / 8] |= static_cast<std::uint8_t>((value >> i & 1u) << bit % 8);
        };
        std::array<unsigned, 3> color{};
        for (unsigned& c : color) c = random() % (halves ? 496 : 128);
        halves ? put(3, 5) : put(0x20, 8);
        if (halves) {
            for (int end = 0; end < 2; ++end)
                for (const unsigned c : color) put(c, 10);
        } else {
            for (const unsigned c : color) put(c, 7), put(c, 7);
            put(255, 8), put(255, 8);
        }
    }
    image.pixels = Blob::of(std::span<const std::uint8_t>(bytes));
    return image;
}

Aspect underSky(const Image& sky) {
    TestScene scene;
    Environment environment;
    environment.image = scene.add(sky);
    environment.showImage = true;
    scene.addEnvironment(environment);
    Material metal;
    metal.metallic = 1;
    metal.roughness = 0.2f;
    scene.place(scene.add(makeSheet(1, 1), scene.add(metal)), Vec3d::Zero());
    return scene.take();
}

/// A bit of everything that sets something: glass, holes, lines, points, shadows, clouds whose rows are no multiple of
/// four bytes.
Aspect everything() {
    TestScene scene;
    scene.addDirectionalLight({0.4, -0.5, -1}, Vec3f::Ones(), 1, true);
    scene.addSpotLight({0, 1, 2}, {0, -0.4, -1}, Vec3f::Ones(), 2, 0.4f, 0.7f, 0, true);
    scene.addPointLight({0.5, 0, 1}, Vec3f(1, 0.5f, 0.2f), 0.5f, 3);
    Material solid, glass, holed;
    glass.alphaMode = Material::kBlend;
    glass.baseColor.w() = 0.4f;
    holed.alphaMode = Material::kMask;
    const std::array<std::uint8_t, 16> pixels{255, 0, 0, 255, 0, 255, 0, 0, 0, 0, 255, 255, 255, 255, 0, 0};
    holed.baseColorImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(pixels)), 2, 2);
    scene.place(scene.add(makeSheet(3, 3), scene.add(solid)), {0, 0, -1});
    scene.place(scene.add(makeSheet(1, 1), scene.add(glass)), {-0.3, 0, 0});
    scene.place(scene.add(makeSheet(1, 1), scene.add(holed)), {0.3, 0, -0.2}, Quatd::Identity(), {-1, 1, 1});
    const std::array<Vec3d, 2> ends{Vec3d(-1, -1, 0.1), Vec3d(1, 1, 0.1)};
    scene.place(scene.add(test::makeLines(ends, 3)), Vec3d::Zero());
    FieldDice dice(3);
    Volume cloud = someVolume(dice);
    cloud.sizeX = 3, cloud.sizeY = 5, cloud.sizeZ = 2;
    cloud.format = Volume::kUint8;
    cloud.voxels = numbersFrom<std::uint8_t>(std::vector<double>(30, 90));
    cloud.mode = Volume::kCloud;
    scene.place(scene.addCore(cloud), {0, 0, 0.3});
    return scene.take();
}

class StateTest : public RendererTest {
protected:
    template <typename Function>
    Function function(const char* name) {
        return reinterpret_cast<Function>(surface_->procAddress(name));
    }
    /// With a context that nobody has drawn with.
    void restartAnew(const RendererOptions& options) {
        renderer_.reset();
        surface_ = makeSurface("osmesa").value();
        renderer_ = Renderer::create(*surface_, options).value();
    }
    /// The names that GL has given, of all kinds.
    std::vector<std::string> objects() {
        EXPECT_TRUE(surface_->makeCurrent());
        std::vector<std::string> found;
        constexpr GLuint kLast = 4096;  // names are given from 1 on
        for (const char* kind : {"Buffer", "Texture", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Shader",
                                 "Sampler", "Query", "ProgramPipeline", "TransformFeedback"}) {
            const auto is = function<PFNGLISBUFFERPROC>(("glIs" + std::string(kind)).c_str());
            for (GLuint name = 1; name <= kLast; ++name)
                if (is(name)) found.push_back(kind + std::to_string(name));
        }
        return found;
    }
    /// All that GL keeps which this renderer, or anybody who draws, might set.
    std::map<std::string, std::vector<GLint>> state() {
        EXPECT_TRUE(surface_->makeCurrent());
        const auto getInteger = function<PFNGLGETINTEGERVPROC>("glGetIntegerv");
        const auto getIndexed = function<PFNGLGETINTEGERI_VPROC>("glGetIntegeri_v");
        const auto activeTexture = function<PFNGLACTIVETEXTUREPROC>("glActiveTexture");
        std::map<std::string, std::vector<GLint>> all;
        const auto look = [&](const std::string& name, GLenum what) {
            std::vector<GLint>& values = all[name];
            values.resize(4);
            getInteger(what, values.data());
        };
        constexpr GLenum kPackInvert = 0x8758;
        for (const auto& [name, what] :
             std::initializer_list<std::pair<const char*, GLenum>>{{"pack alignment", GL_PACK_ALIGNMENT},
                                                                   {"pack row length", GL_PACK_ROW_LENGTH},
                                                                   {"pack skip rows", GL_PACK_SKIP_ROWS},
                                                                   {"pack skip pixels", GL_PACK_SKIP_PIXELS},
                                                                   {"pack invert", kPackInvert},
                                                                   {"unpack alignment", GL_UNPACK_ALIGNMENT},
                                                                   {"unpack row length", GL_UNPACK_ROW_LENGTH},
                                                                   {"draw framebuffer", GL_DRAW_FRAMEBUFFER_BINDING},
                                                                   {"read framebuffer", GL_READ_FRAMEBUFFER_BINDING},
                                                                   {"program", GL_CURRENT_PROGRAM},
                                                                   {"vertex array", GL_VERTEX_ARRAY_BINDING},
                                                                   {"scissor test", GL_SCISSOR_TEST},
                                                                   {"depth test", GL_DEPTH_TEST},
                                                                   {"depth function", GL_DEPTH_FUNC},
                                                                   {"depth mask", GL_DEPTH_WRITEMASK},
                                                                   {"depth clamp", GL_DEPTH_CLAMP},
                                                                   {"color mask", GL_COLOR_WRITEMASK},
                                                                   {"blend", GL_BLEND},
                                                                   {"blend source", GL_BLEND_SRC_RGB},
                                                                   {"blend destination", GL_BLEND_DST_RGB},
                                                                   {"blend source alpha", GL_BLEND_SRC_ALPHA},
                                                                   {"blend destination alpha", GL_BLEND_DST_ALPHA},
                                                                   {"cull", GL_CULL_FACE},
                                                                   {"cull which", GL_CULL_FACE_MODE},
                                                                   {"front", GL_FRONT_FACE},
                                                                   {"clip origin", GL_CLIP_ORIGIN},
                                                                   {"clip depth", GL_CLIP_DEPTH_MODE},
                                                                   {"viewport", GL_VIEWPORT},
                                                                   {"scissor", GL_SCISSOR_BOX},
                                                                   {"seamless cubes", GL_TEXTURE_CUBE_MAP_SEAMLESS}})
            look(name, what);
        for (GLuint i = 0; i < 4; ++i) {
            GLint bound = 0;
            getIndexed(GL_UNIFORM_BUFFER_BINDING, i, &bound);
            all["uniforms " + std::to_string(i)] = {bound};
            getIndexed(GL_SHADER_STORAGE_BUFFER_BINDING, i, &bound);
            all["storage " + std::to_string(i)] = {bound};
        }
        GLint units = 0;
        getInteger(GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS, &units);
        for (GLint unit = 0; unit < std::min(units, 48); ++unit) {
            activeTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
            for (const auto& [name, what] :
                 std::initializer_list<std::pair<const char*, GLenum>>{{"flat", GL_TEXTURE_BINDING_2D},
                                                                       {"solid", GL_TEXTURE_BINDING_3D},
                                                                       {"cube", GL_TEXTURE_BINDING_CUBE_MAP},
                                                                       {"several", GL_TEXTURE_BINDING_2D_MULTISAMPLE},
                                                                       {"array", GL_TEXTURE_BINDING_2D_ARRAY},
                                                                       {"buffer", GL_TEXTURE_BINDING_BUFFER},
                                                                       {"rectangle", GL_TEXTURE_BINDING_RECTANGLE},
                                                                       {"sampler", GL_SAMPLER_BINDING}})
                look("unit " + std::to_string(unit) + " " + name, what);
        }
        activeTexture(GL_TEXTURE0);
        EXPECT_TRUE(GlFunctions::load(*surface_)->check("asking"));
        return all;
    }
};

TEST_F(StateTest, NothingOutlivesACall) {
    for (const int samples : {1, 4}) {
        restartAnew({.samples = samples});
        const auto first = state();
        const auto expectAsAtFirst = [&](const char* after) {
            const auto now = state();
            for (const auto& [name, values] : first)
                EXPECT_EQ(now.at(name), values) << name << ", after " << after << ", samples " << samples;
        };
        const Aspect aspect = everything();
        const ScreenCamera camera = cameraOf(70, 50);
        const Picture seen = draw(aspect, camera);
        EXPECT_GT(*std::ranges::max_element(seen.rgb), 100);
        expectAsAtFirst("draw");
        ASSERT_TRUE(renderer_->drawNodeIds(aspect, listOf(aspect, camera), camera, whole(camera)));
        expectAsAtFirst("drawNodeIds");
        RenderScene scene;
        scene.update(aspect, nullptr);
        for (const CullerKind culler : {CullerKind::kQueriesWait, CullerKind::kQueries, CullerKind::kTwoPhase}) {
            RenderAction action(culler);
            // Of a device that is asked thing after thing the next call puts back what is left.
            for (int i = 0; i < 3; ++i)
                ASSERT_TRUE(action.run(scene, camera, whole(camera), &renderer_->visibility(), nullptr));
            EXPECT_EQ(draw(aspect, camera).rgb, seen.rgb);
            expectAsAtFirst("visibility, and a picture");
        }
        for (int i = 0; i < 8 && renderer_->prepare(); ++i) expectAsAtFirst("prepare");
        ASSERT_TRUE(renderer_->pixelProbe());
        expectAsAtFirst("pixelProbe");
        const std::function<bool()> unwanted = [asked = 0]() mutable { return ++asked > 4; };
        const auto leftOff =
            renderer_->drawWhileWanted(aspect, listOf(aspect, camera), camera, whole(camera), unwanted);
        ASSERT_TRUE(leftOff && !*leftOff);
        expectAsAtFirst("a picture that nobody wants");
        EXPECT_EQ(draw(aspect, camera).rgb, seen.rgb);
        (void)draw(underSky(blockSky(Image::kBc6h, true)), camera);
        expectAsAtFirst("a sky");
    }
}

/// So that a context may have one renderer after the other.
TEST_F(StateTest, ARendererThatGoesLeavesNothingInItsContext) {
    for (const int samples : {1, 4}) {
        restartAnew({.samples = samples});
        renderer_.reset();
        const auto first = state();
        renderer_ = Renderer::create(*surface_, {.samples = samples}).value();
        const ScreenCamera camera = cameraOf(70, 50);
        const Aspect aspect = everything();
        (void)draw(underSky(blockSky(Image::kBc6h, true)), camera);
        (void)draw(aspect, camera);
        ASSERT_TRUE(renderer_->pixelProbe());
        RenderScene scene;
        scene.update(aspect, nullptr);
        RenderAction action(CullerKind::kQueriesWait);
        for (int i = 0; i < 3; ++i)
            ASSERT_TRUE(action.run(scene, camera, whole(camera), &renderer_->visibility(), nullptr));
        EXPECT_FALSE(objects().empty());
        renderer_.reset();
        EXPECT_EQ(objects(), std::vector<std::string>());
        EXPECT_EQ(state(), first);
    }
}

TEST_F(StateTest, ASkyOfBlocksIsTheSameAfterAnyReadBack) {
    for (const std::int64_t encoding : {Image::kBc6h, Image::kBc7})
        for (const bool cube : {false, true}) {
            const Aspect sky = underSky(blockSky(encoding, cube));
            const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
            restart({.samples = 1});
            const Picture first = draw(sky, camera);
            // Rows longer than the sky's, or shorter.
            const int width = cube == (encoding == Image::kBc7) ? 200 : 5;
            restart({.samples = 1});
            (void)draw(everything(), cameraOf(width, 40));
            EXPECT_EQ(draw(sky, camera).rgb, first.rgb)
                << "encoding " << encoding << (cube ? ", a cube" : ", flat") << ", after " << width;
        }
}

/// What a buffer holds next may end before the part that is bound, and who draws without it has it copied all the same
/// (found by ASan: a list of shadows with more looks than that of the cell behind it).
TEST_F(StateTest, APartOfABufferThatIsFilledAnewIsBoundNoMore) {
    ASSERT_TRUE(surface_->makeCurrent());
    static std::map<GLuint, GLuint> bound;  // what the functions that are GL's own were told last
    bound.clear();
    struct Told : GlFunctions {
        explicit Told(const GlFunctions& functions) : GlFunctions(functions) {
            BindBufferBase = [](GLenum, GLuint index, GLuint buffer) { bound[index] = buffer; };
            BindBufferRange = [](GLenum, GLuint index, GLuint buffer, GLintptr, GLsizeiptr) { bound[index] = buffer; };
        }
    };
    GlState gl(Told(GlFunctions::load(*surface_).value()));
    std::array<GLuint, 2> buffers{};
    gl.CreateBuffers(2, buffers.data());
    for (const GLuint buffer : buffers) gl.NamedBufferData(buffer, 4096, nullptr, GL_STREAM_DRAW);
    gl.BindBufferRange(GL_UNIFORM_BUFFER, 1, buffers[0], 2048, 512);
    gl.BindBufferRange(GL_UNIFORM_BUFFER, 2, buffers[1], 2048, 512);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, 3, buffers[0]);
    gl.NamedBufferData(buffers[0], 512, nullptr, GL_STREAM_DRAW);
    EXPECT_EQ(bound, (std::map<GLuint, GLuint>{{1, 0}, {2, buffers[1]}, {3, buffers[0]}}));
    gl.DeleteBuffers(2, buffers.data());
}

}  // namespace
}  // namespace tessera
