#include "client/draw/shaders/Program.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/draw/shaders/LoopWatch.h"
#include "client/draw/shaders/PersonPrograms.h"
#include "client/draw/shaders/ShaderText.h"
#include "client/draw/shaders/ToneCurves.h"
#include "client/draw/store/DrawForms.h"
#include "client/draw/store/VolumeTextures.h"
#include "common/cores/SurfaceParts.h"
#include "common/wall/LightHistogram.h"

namespace tessera {
namespace {

Expected<GLuint> compile(const GlFunctions& gl, GLenum stage, const std::string& text) {
    const GLuint shader = gl.CreateShader(stage);
    const char* pointer = text.c_str();
    gl.ShaderSource(shader, 1, &pointer, nullptr);
    gl.CompileShader(shader);
    GLint good = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (good) return shader;
    std::array<char, 1024> log{};
    gl.GetShaderInfoLog(shader, log.size(), nullptr, log.data());
    gl.DeleteShader(shader);
    return fail(ErrorCode::kUnsupported, std::string("the surface refuses a shader: ") + log.data());
}

bool readsSurface(const ProgramKind& kind) {
    using Use = ProgramKind::Use;
    const bool cuts = kind.masked || kind.person != 0;
    return kind.use == Use::kSurface || kind.use == Use::kBlend ||
           ((kind.use == Use::kNodeIds || kind.use == Use::kShadow) && cuts);
}

/// What is drawn over the whole screen lies there: where the depth test compares it with what kClassify has written.
/// Of one sample there are no classes: where something is, its depth is above 0.
const char* screenDepthOf(const ProgramKind& kind) {
    using Use = ProgramKind::Use;
    if (kind.use == Use::kLightOne && kind.samples == 1)
        return kind.studio ? "0.0" : kind.environment ? "(frame.surround[1].w > 0.5 ? 0.0 : 1e-30)" : "1e-30";
    if (kind.use == Use::kClear || kind.use == Use::kMeter) return "0.0";
    return kind.use == Use::kLightRest ? "0.9" : kind.use == Use::kLight ? "0.6" : "0.5";
}

/// Passes that light what the first one has packed.
bool lightsScreen(const ProgramKind& kind) {
    return isLit(kind.use) && kind.use != ProgramKind::Use::kBlend;
}

/// By LayerLookup: the sampler, and the shader's function that says where (kSurface).
constexpr std::array<std::pair<const char*, const char*>, 8> kLayerLookups = {{{"", ""},
                                                                               {"sampler2D", "byTexcoords"},
                                                                               {"sampler2D", "bySphere"},
                                                                               {"sampler2D", "allAround"},
                                                                               {"sampler2D", "byPosition"},
                                                                               {"samplerCube", "byReflection"},
                                                                               {"samplerCube", "fromOrigin"},
                                                                               {"sampler3D", "inSolid"}}};

/// What the shaders call values that are ours. No directive of theirs has a number of its own.
std::string namesOfValues() {
    std::string text;
    const auto name = [&](const char* what, auto value) {
        text += fmt::format("#define {} {}\n", what, static_cast<int>(value));
    };
    name("LIGHTS_ALL", LightLists::kAll);
    name("LIGHTS_CLUSTERS", LightLists::kClusters);
    name("LIGHTS_SHADOWS", LightLists::kShadows);
    name("LIGHTS_SUN", LightLists::kSun);
    name("LIGHTS_SUNS", LightLists::kSuns);
    name("LIGHTS_FEW", LightLists::kFew);
    name("MAP_BASE_COLOR", bitOf(ImageMap::kBaseColor));
    name("MAP_METALLIC_ROUGHNESS", bitOf(ImageMap::kMetallicRoughness));
    name("MAP_NORMAL", bitOf(ImageMap::kNormal));
    name("MAP_OCCLUSION", bitOf(ImageMap::kOcclusion));
    name("MAP_EMISSIVE", bitOf(ImageMap::kEmissive));
    name("DETAIL_MAPS", kDetailMaps);
    name("POINT_COLORS", kPointColors);
    name("POINT_NORMALS", kPointNormals);
    name("POINT_TEXCOORDS", kPointTexcoords);
    name("POINT_STRETCHED", kPointStretched);
    name("MARCH_KIND", kMarchKind);
    name("MARCH_SHADED", kMarchShaded);
    name("MARCH_MAXIMUM", kMarchMaximum);
    name("MARCH_EACH_SAMPLE", kMarchEachSample);
    return text;
}

/// Version, switches and blocks: the same in front of both stages.
std::string headOf(const ProgramKind& kind, const PersonText* person) {
    using Use = ProgramKind::Use;
    std::string head = namesOfValues();
    const auto define = [&](bool wanted, const char* name) {
        if (wanted) head += fmt::format("#define {}\n", name);
    };
    define(readsSurface(kind), "SURFACE");
    define(kind.faceted, "FACETED");
    define(kind.layers != 0, "LAYERS");
    define(person != nullptr, "PERSON");
    const bool moved = person && !person->vertex.empty();
    define(moved, "MOVED");
    // What a person's program moves turns its normals, and says nothing of tangents.
    const bool tangents = kind.tangents && !moved;
    define(tangents, "TANGENTS");
    define(person || kind.faceted || kind.layers != 0 || kind.use == Use::kBlend ||
               ((kind.maps & bitOf(ImageMap::kNormal)) != 0 && !tangents),
           "POSITION");
    head += fmt::format("#define {} {}\n", formOf(kind.items).define, kind.pointParts);
    define(formOf(kind.items).fetched != nullptr, "FETCHED");
    define(kind.large, "LARGE");
    define(kind.masked, "MASKED");
    define(kind.plain, "PLAIN");
    define(kind.detail, "DETAIL");
    define(kind.coated, "COATED");
    define(kind.glossy, "GLOSSY");
    define(kind.scoped, "SCOPED");
    define(kind.cubes, "CUBES");
    define(kind.oneSun, "ONE_SUN");
    define(kind.environment, "ENVIRONMENT");
    define(kind.studio, "STUDIO");
    define(kind.use == Use::kNodeIds, "NODE");
    define(kind.use == Use::kBlend, "BLENDED");
    define(kind.use == Use::kShadow, "SHADOW");
    const bool inItem = kind.items == MeshKind::kPoints && readsSurface(kind) && (kind.layers != 0 || person);
    define(inItem, "IN_ITEM");
    define(inItem || (kind.items == MeshKind::kPoints && (kind.pointParts & kPointStretched) != 0), "ROWS");
    define(kind.use == Use::kLightRest, "REST");
    define(kind.use == Use::kLightOne || kind.use == Use::kMeter, "ONE_SURFACE");
    if (kind.use == Use::kMeter) {
        using Light = LightHistogram;
        head += fmt::format(
            "#define METER\n#define LEAST_STOPS {}.0\n#define CLASSES_PER_STOP {}.0\n"
            "#define MOST_CLASSES {}.0\n",
            Light::kLeastStops, Light::kClassesPerStop, Light::kClasses);
        // The middle of the one pixel of a square that is looked at.
        head += fmt::format("#define PIXEL ({}.0 * gl_FragCoord.xy + {})\n", Light::kSquarePx,
                            Light::kPlaceInSquare + 0.5 - 0.5 * Light::kSquarePx);
    } else if (isLit(kind.use)) {
        head += fmt::format("#define PIXEL gl_FragCoord.xy\n#define TONE_CURVE {}\n", toneCurveOf(kind.toneMap));
    }
    head += fmt::format("#define SCREEN_DEPTH {}\n", screenDepthOf(kind));
    for (unsigned i = 0; i < Material::kMostLayers; ++i)
        if (const auto& [sampler, place] = kLayerLookups[kind.layers >> (kLayerBits * i) & 7u]; *sampler)
            head += fmt::format("#define LAYER{}_SAMPLER {}\n#define LAYER{}_PLACE {}\n", i, sampler, i, place);
    if (kind.look) head += fmt::format("#define MAPS {}\n", kind.maps);
    head += fmt::format("#define SAMPLES {}\n#define LIGHTS {}\n", kind.samples, static_cast<int>(kind.lists));
    define(kind.lists == LightLists::kSun || kind.lists == LightLists::kSuns, "SUNS_ALONE");
    define(lightsScreen(kind), "FRAME_PASSED_ON");
    return head + shader_text::kBlocks;
}

std::string toScreen() {
    return std::string(shader_text::kToneCurves) + shader_text::kToneMapping;
}

/// What draws an item, without what points have before it.
std::string itemFragmentOf(const ProgramKind& kind) {
    using Use = ProgramKind::Use;
    switch (kind.use) {
        case Use::kSurface:
            return std::string(shader_text::kSurface) + shader_text::kPackNormal + shader_text::kPackFragment;
        case Use::kClear:
            return shader_text::kClearFragment;
        case Use::kClassify:
            return std::string(shader_text::kReadSurface) + shader_text::kClassifyFragment;
        case Use::kLightOne:
        case Use::kLight:
        case Use::kLightRest:
        case Use::kMeter:
            return std::string("#define PASSED flat in\n") + shader_text::kPassedFrame + shader_text::kLighting +
                   (kind.use == Use::kMeter ? std::string() : toScreen()) + shader_text::kReadSurface +
                   shader_text::kLightFragment;
        case Use::kBlend:
            if (rowOf(kind.items).volume)
                return fmt::format("#define MOST_SAMPLES {}\n#define BRICK_SIDE {}.0\n#define BRICK_INVERSE {}\n",
                                   kMostMarchSamples + 2, VolumeBricks::kSide, 1.0 / VolumeBricks::kSide) +
                       shader_text::kLighting + toScreen() + shader_text::kVolumeFragment;
            return shader_text::kLighting + toScreen() + shader_text::kSurface + shader_text::kBlendFragment;
        case Use::kCopy:
            return shader_text::kCopyFragment;
        case Use::kSpread:
            return std::string(shader_text::kReadSurface) + shader_text::kSpreadFragment;
        case Use::kResolve:
            return shader_text::kResolveFragment;
        case Use::kShadow:
            return (readsSurface(kind) ? shader_text::kSurface : "") + std::string(shader_text::kShadowFragment);
        case Use::kNodeIds:
            return (readsSurface(kind) ? shader_text::kSurface : "") + std::string(shader_text::kNodeIdFragment);
        case Use::kDepth:
        case Use::kPlates:
            return shader_text::kDepthFragment;
        case Use::kFarthest:
            return shader_text::kFarthestFragment;
    }
    return {};
}

std::string fragmentOf(const ProgramKind& kind) {
    return (kind.items == MeshKind::kPoints ? shader_text::kPointFragment : "") + itemFragmentOf(kind);
}

std::string vertexOf(const ProgramKind& kind) {
    using Use = ProgramKind::Use;
    switch (kind.use) {
        case Use::kSurface:
        case Use::kBlend:
        case Use::kNodeIds:
        case Use::kDepth:
        case Use::kShadow:
            return shader_text::kItemInputs +
                   (kind.items == MeshKind::kPoints ? std::string(shader_text::kPackNormal) + shader_text::kPointVertex
                                                    : std::string()) +
                   shader_text::kMeshVertex;
        case Use::kLightOne:
        case Use::kLight:
        case Use::kLightRest:
        case Use::kMeter:
            return std::string("#define PASSED flat out\n") + shader_text::kPassedFrame + shader_text::kScreenVertex;
        case Use::kClear:
        case Use::kClassify:
        case Use::kCopy:
        case Use::kSpread:
        case Use::kResolve:
        case Use::kFarthest:
            return shader_text::kScreenVertex;
        case Use::kPlates:
            return shader_text::kPlateVertex;
    }
    return {};
}

/// In front of all else, where no macro of ours is known: a person's text, and what that is given. Of both stages
/// `surface` or `vertex`.
std::string beginningOf(const ProgramKind& kind, const PersonText* person, bool fragment) {
    std::string text = "#version 450 core\n";
    if (fragment && readsSurface(kind)) text += shader_text::kSurfaceStruct;
    if (!person) return text;
    const std::string& own = fragment ? person->surface : person->vertex;
    if (person->loops)
        text += fmt::format(
            "layout(std430, binding = {}) readonly buffer TesseraLoops {{ int tesseraMostRounds; }};\nint "
            "tesseraRounds = tesseraMostRounds;\n",
            LoopWatch::kBinding);
    text += "uniform float tesseraReach;\nvec2 uv, uv1;\n";
    if (fragment) text += "vec3 nodePosition, eyePosition, worldPosition;\n";
    static constexpr std::array kTypes = {"sampler2D", "float", "vec2", "vec3", "vec4"};
    GLuint unit = kPersonUnit;
    for (const PersonUniform& uniform : person->uniforms) {
        if (uniform.width == 0) text += fmt::format("layout(binding = {}) ", unit++);
        text += fmt::format("uniform {} {};\n", kTypes[uniform.width], uniform.name);
    }
    if (own.empty()) return fragment ? text + "void surface(inout Surface s) {}\n" : text;
    return text + fmt::format("#line {}\n{}\n#line 1\n", (fragment ? kSurfaceLines : kVertexLines) + 1, own);
}

}  // namespace

LayerLookup lookupOf(std::int64_t source, std::int64_t shape) {
    const bool solid = shape == Image::kSolid, cube = shape == Image::kCube;
    switch (source) {
        case TextureLayer::kTexcoords:
            return solid || cube ? LayerLookup::kNone : LayerLookup::kFlatByTexcoords;
        case TextureLayer::kSphere:
            return solid || cube ? LayerLookup::kNone : LayerLookup::kFlatBySphere;
        case TextureLayer::kReflection:
            return solid ? LayerLookup::kNone : cube ? LayerLookup::kCubeByReflection : LayerLookup::kFlatByReflection;
        case TextureLayer::kPosition:
            return solid  ? LayerLookup::kSolidByPosition
                   : cube ? LayerLookup::kCubeByPosition
                          : LayerLookup::kFlatByPosition;
        default:
            return LayerLookup::kNone;
    }
}

bool isLit(ProgramKind::Use use) {
    using Use = ProgramKind::Use;
    return use == Use::kLightOne || use == Use::kLight || use == Use::kLightRest || use == Use::kMeter ||
           use == Use::kBlend;
}

std::array<std::uint32_t, 2> packedMaterial(std::uint32_t material, const std::array<float, 4>& color) {
    std::array<std::uint32_t, 2> packed = {(material & 63u) << 26u, (material >> 6u) << 24u};
    for (std::size_t i = 0; i < 3; ++i)
        packed[1] |= static_cast<std::uint32_t>(std::sqrt(std::clamp(color[i], 0.0f, 1.0f)) * 255.0f + 0.5f) << (8 * i);
    return packed;
}

ProgramKind otherwiseLit(ProgramKind kind, LightLists lists, bool environment, bool scoped) {
    kind.lists = lists;
    kind.scoped = scoped;
    kind.environment = environment;
    kind.studio = kind.cubes = kind.oneSun = false;
    return kind;
}

ProgramKind shadowOf(const ProgramKind& surface) {
    ProgramKind kind{.use = ProgramKind::Use::kShadow,
                     .items = surface.items,
                     .pointParts = surface.pointParts,
                     .masked = surface.masked,
                     .person = surface.person};
    // A program may ask for any of them.
    if (surface.masked || surface.person)
        kind.maps = surface.person ? surface.maps : surface.maps & bitOf(ImageMap::kBaseColor);
    kind.look = surface.masked || surface.person;
    kind.faceted = surface.person && surface.faceted;
    kind.tangents = surface.tangents && (kind.maps & bitOf(ImageMap::kNormal)) != 0;
    return kind;
}

ProgramText programText(const ProgramKind& kind, const PersonText* person) {
    const std::string head = headOf(kind, person);
    return {.vertex = beginningOf(kind, person, false) + head + vertexOf(kind),
            .fragment = beginningOf(kind, person, true) + head + fragmentOf(kind)};
}

Expected<Program> Program::create(const GlFunctions& gl, const ProgramKind& kind, const PersonText* person) {
    const ProgramText text = programText(kind, person);
    const auto vertex = compile(gl, GL_VERTEX_SHADER, text.vertex);
    if (!vertex) return tl::unexpected(vertex.error());
    const auto fragment = compile(gl, GL_FRAGMENT_SHADER, text.fragment);
    if (!fragment) {
        gl.DeleteShader(*vertex);
        return tl::unexpected(fragment.error());
    }
    Program program(gl.DeleteProgram, gl.CreateProgram());
    gl.AttachShader(program.name_, *vertex);
    gl.AttachShader(program.name_, *fragment);
    gl.LinkProgram(program.name_);
    gl.DeleteShader(*vertex);
    gl.DeleteShader(*fragment);
    GLint good = 0;
    gl.GetProgramiv(program.name_, GL_LINK_STATUS, &good);
    if (good && person) {
        for (const PersonUniform& uniform : person->uniforms)
            program.locations_.push_back(gl.GetUniformLocation(program.name_, uniform.name.c_str()));
        program.locations_.push_back(gl.GetUniformLocation(program.name_, "tesseraReach"));
    }
    if (good) return program;
    std::array<char, 1024> log{};
    gl.GetProgramInfoLog(program.name_, log.size(), nullptr, log.data());
    return fail(ErrorCode::kUnsupported, std::string("the surface refuses a program: ") + log.data());
}

Program::~Program() {
    if (name_) destroy_(name_);
}

Program::Program(Program&& other) noexcept
    : destroy_(other.destroy_), name_(std::exchange(other.name_, 0)), locations_(std::move(other.locations_)) {}

}  // namespace tessera
