#include "client/draw/Program.h"

#include <utility>

namespace tessera {
namespace {

// One vertex shader text for all programs and all tiles, its position invariant: coordinates, and so seams, are the same
// in each of them.
constexpr char kVertexText[] = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
layout(location = 3) in vec2 texcoord;
layout(location = 4) in vec4 eyeRow0;
layout(location = 5) in vec4 eyeRow1;
layout(location = 6) in vec4 eyeRow2;
layout(location = 7) in vec4 normalRow0;
layout(location = 8) in vec4 normalRow1;
layout(location = 9) in vec4 normalRow2;
layout(location = 10) in vec4 baseColor;
layout(location = 11) in vec4 emissive;
layout(location = 12) in uvec2 node;

invariant gl_Position;
#ifdef NODE_IDS
flat out uvec2 vNode;
#else
out vec3 vPosition;
out vec3 vNormal;
out vec4 vColor;
flat out vec4 vEmissiveAndRoughness;
flat out vec2 vMetallicAndFaceted;
#ifdef TEXTURED
out vec2 vTexcoord;
#endif
#endif

void main() {
    vec4 p = vec4(position, 1.0);
    vec3 eye = vec3(dot(eyeRow0, p), dot(eyeRow1, p), dot(eyeRow2, p));
    gl_Position = clip_T_eye * vec4(eye, 1.0);
#ifdef NODE_IDS
    vNode = node;
#else
    vPosition = eye;
    vNormal = vec3(dot(normalRow0.xyz, normal), dot(normalRow1.xyz, normal), dot(normalRow2.xyz, normal));
    vColor = baseColor * color;
    vEmissiveAndRoughness = vec4(emissive.rgb, normalRow0.w);
    vMetallicAndFaceted = vec2(normalRow1.w, normalRow2.w);
#ifdef TEXTURED
    vTexcoord = texcoord;
#endif
#endif
}
)";

constexpr char kFrameBlockText[] = R"(
struct Light {
    vec4 place;
    vec4 radiance;
};
layout(std140, binding = 0) uniform FrameBlock {
    mat4 clip_T_eye;
    vec4 worldRow0, worldRow1, worldRow2;
    vec4 sky, ground;
    Light lights[16];
};
)";

// Metal-roughness as glTF 2.0 (appendix B) defines it: GGX distribution, Smith's visibility in Hammon's approximation
// (2017), Schlick's Fresnel term. A light of radiance 1 that falls straight onto a white surface gives 1: the factor pi
// is taken into the light.
constexpr char kLitFragmentText[] = R"(
in vec3 vPosition;
in vec3 vNormal;
in vec4 vColor;
flat in vec4 vEmissiveAndRoughness;
flat in vec2 vMetallicAndFaceted;
#ifdef TEXTURED
in vec2 vTexcoord;
layout(binding = 0) uniform sampler2D baseColorImage;
#endif
layout(location = 0) out vec4 outColor;

// Radiance from a direction in the world: sky, horizon and ground, and three lamps as in a photographer's studio, so that
// metal has something to reflect. A function of the direction alone; a rough surface sees it blurred.
vec3 environment(vec3 d, float roughness) {
    float blur = 0.06 + 0.94 * roughness;
    vec3 c = mix(ground.rgb, sky.rgb, smoothstep(-blur, blur, d.y));
    float horizon = d.y / (0.18 + 0.6 * roughness);
    c += 0.35 * sky.rgb / (1.0 + 4.0 * horizon * horizon);
    vec3 toLamps = vec3(dot(d, vec3(0.0, 1.0, 0.0)), dot(d, vec3(0.64, 0.48, 0.60)), dot(d, vec3(-0.80, 0.36, 0.48)));
    vec3 lamps = smoothstep(vec3(0.90, 0.93, 0.95) - 0.7 * blur, vec3(0.90, 0.93, 0.95) + 0.06 * blur, toLamps);
    return c + sky.rgb * dot(lamps, vec3(2.2, 3.0, 1.6)) / (1.0 + 5.0 * roughness * roughness);
}

// Integral of the specular lobe over a white environment (Karis 2014, "Physically based shading on mobile").
vec3 environmentFactor(vec3 f0, float roughness, float nv) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    vec2 scaleAndBias = vec2(-1.04, 1.04) * a + r.zw;
    return f0 * scaleAndBias.x + scaleAndBias.y;
}

// Khronos PBR Neutral (2024) without its toe: the identity up to 0.8, so that colours stay what they are; highlights fade
// towards white.
vec3 toneMap(vec3 c) {
    float peak = max(max(c.r, c.g), c.b);
    if (peak <= 0.8) return c;
    float newPeak = 1.0 - 0.04 / (peak - 0.6);
    c *= newPeak / peak;
    float whiter = 1.0 - 1.0 / (0.15 * (peak - newPeak) + 1.0);
    return mix(c, vec3(newPeak), whiter);
}

struct Lit {
    vec3 n, v, f0;
    float nv, alpha, alpha2;
    vec3 diffuse, specular;
};

// A software rasteriser has no jumps: lanes that a light does not reach are masked, not skipped. So there are no branches.
void addLight(inout Lit lit, vec4 place, vec4 radiance) {
    vec3 l = place.xyz - vPosition * place.w;
    float d2 = max(dot(l, l), 1e-8);
    float invD = inversesqrt(d2);
    l *= invD;
    // Window of KHR_lights_punctual: the light is zero at its range. Of a directional light, place.w is 0.
    float x2 = d2 * radiance.w * radiance.w;
    float nl = clamp(dot(lit.n, l), 0.0, 1.0);
    float strength = nl * mix(1.0, invD * invD * max(1.0 - x2 * x2, 0.0), place.w);
    // With h = (l + v) / |l + v|: |l + v|^2 = 2 + 2 l.v, so n.h and h.v need no vector h.
    float lv = dot(l, lit.v);
    float invH = inversesqrt(max(2.0 + 2.0 * lv, 1e-6));
    float nh = min((nl + lit.nv) * invH, 1.0);
    float grazing = 1.0 - min((1.0 + lv) * invH, 1.0);
    float grazing2 = grazing * grazing;
    vec3 fresnel = lit.f0 + (1.0 - lit.f0) * (grazing2 * grazing2 * grazing);
    float q = nh * nh * (lit.alpha2 - 1.0) + 1.0;
    float lobe = 0.5 * lit.alpha2 / max(q * q * mix(2.0 * nl * lit.nv, nl + lit.nv, lit.alpha), 1e-6);
    vec3 arriving = radiance.rgb * strength;
    lit.diffuse += arriving * (1.0 - fresnel);
    lit.specular += arriving * min(lobe, 40.0) * fresnel;
}

vec3 encodeSrgb(vec3 c) {
    vec3 s1 = sqrt(max(c, vec3(0.0)));
    vec3 s2 = sqrt(s1);
    vec3 s3 = sqrt(s2);
    return mix(0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.0225411470 * c, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

void main() {
    // Derivatives first: they are not defined in a branch. The face's normal points to the eye by construction.
    vec3 faceNormal = cross(dFdx(vPosition), dFdy(vPosition));
    vec3 n = vMetallicAndFaceted.y > 0.5 ? faceNormal : (gl_FrontFacing ? vNormal : -vNormal);
    // A normal of no length (degenerate triangles, zero normals in a file) faces the eye.
    float length2 = dot(n, n);
    vec3 v = normalize(-vPosition);
    n = length2 > 1e-30 ? n * inversesqrt(length2) : v;

    vec4 base = vColor;
#ifdef TEXTURED
    base *= texture(baseColorImage, vTexcoord);
#endif
    float roughness = clamp(vEmissiveAndRoughness.a, 0.045, 1.0);
    float metallic = vMetallicAndFaceted.x;
    float alpha = roughness * roughness;
    vec3 albedo = base.rgb * (1.0 - metallic);
    vec3 f0 = mix(vec3(0.04), base.rgb, metallic);
    float nv = max(dot(n, v), 1e-3);

    vec3 up = vec3(worldRow1.xyz);
    vec3 diffuse = mix(ground.rgb, sky.rgb, 0.5 + 0.5 * dot(n, up));
    vec3 r = 2.0 * dot(n, v) * n - v;
    vec3 rWorld = vec3(dot(worldRow0.xyz, r), dot(worldRow1.xyz, r), dot(worldRow2.xyz, r));
    vec3 specular = environmentFactor(f0, roughness, nv) * environment(rWorld, roughness);

    Lit lit = Lit(n, v, f0, nv, alpha, alpha * alpha, diffuse, specular);
    FOR_EACH_LIGHT
    diffuse = lit.diffuse;
    specular = lit.specular;

    // What is transparent shows its highlights all the same.
    vec3 solid = albedo * diffuse + vEmissiveAndRoughness.rgb;
    float a = clamp(base.a, 0.0, 1.0);
    float shine = min(max(max(specular.r, specular.g), specular.b), 1.0);
    float outAlpha = a + (1.0 - a) * shine;
    vec3 c = (solid * a + specular) / max(outAlpha, 1e-3);
    outColor = vec4(encodeSrgb(toneMap(c)), outAlpha);
}
)";

constexpr char kNodeIdFragmentText[] = R"(
flat in uvec2 vNode;
layout(location = 0) out uvec2 outNode;
void main() { outNode = vNode; }
)";

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

}  // namespace

Expected<Program> Program::create(const GlFunctions& gl, ProgramKind kind, std::size_t lightCount) {
    std::string head = "#version 450 core\n#define FOR_EACH_LIGHT";
    for (std::size_t i = 0; i < lightCount; ++i) {
        const std::string light = "lights[" + std::to_string(i) + "]";
        head += " addLight(lit, " + light + ".place, " + light + ".radiance);";
    }
    head += "\n";
    if (kind == ProgramKind::kNodeIds) head += "#define NODE_IDS\n";
    if (kind == ProgramKind::kLitTextured) head += "#define TEXTURED\n";
    head += kFrameBlockText;
    const auto vertex = compile(gl, GL_VERTEX_SHADER, head + kVertexText);
    if (!vertex) return tl::unexpected(vertex.error());
    const auto fragment =
        compile(gl, GL_FRAGMENT_SHADER, head + (kind == ProgramKind::kNodeIds ? kNodeIdFragmentText : kLitFragmentText));
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
    if (good) return program;
    std::array<char, 1024> log{};
    gl.GetProgramInfoLog(program.name_, log.size(), nullptr, log.data());
    return fail(ErrorCode::kUnsupported, std::string("the surface refuses a program: ") + log.data());
}

Program::~Program() {
    if (name_) destroy_(name_);
}

Program::Program(Program&& other) noexcept : destroy_(other.destroy_), name_(std::exchange(other.name_, 0)) {}

}  // namespace tessera
