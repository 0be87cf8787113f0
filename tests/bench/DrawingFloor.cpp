/// The least that a picture of a mesh costs here: plain OpenGL on OSMesa in one process, one colour, one light, depth,
/// one sample, and its pixels read back. A program of its own, with LP_NUM_THREADS as it is told.
///
///     bench_drawing_floor MESH WIDTH HEIGHT SIDES    # 16 numbers, clip_T_world by columns, on the standard input:
///     milliseconds
///
/// MESH: counts of corners and of indices (u32 each), positions, normals (3 floats each), indices (u32). SIDES:
/// `front`, or `both` where faces are drawn that are seen from behind.
#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>

#include <GL/glext.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <vector>

namespace tessera::bench {
namespace {

constexpr const char* kVertex =
    "#version 450 core\n"
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 normal;\n"
    "layout(location = 0) uniform mat4 clip_T_world;\n"
    "out vec3 n;\n"
    "void main() { n = normal; gl_Position = clip_T_world * vec4(position, 1.0); }\n";
constexpr const char* kFragment =
    "#version 450 core\n"
    "in vec3 n;\n"
    "layout(location = 0) out vec4 color;\n"
    "void main() { color = vec4(vec3(0.1 + 0.9 * max(0.0, dot(normalize(n), vec3(0.36, 0.48, 0.8)))), 1.0); }\n";

GLuint shader(GLenum kind, const char* text) {
    const GLuint made = glCreateShader(kind);
    glShaderSource(made, 1, &text, nullptr);
    glCompileShader(made);
    return made;
}

template <typename T>
std::vector<T> read(std::ifstream& file, std::size_t count) {
    std::vector<T> values(count);
    file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
    return values;
}

int serve(int argc, char** argv) {
    if (argc != 5) return 2;
    const int width = std::atoi(argv[2]), height = std::atoi(argv[3]);
    std::ifstream file(argv[1], std::ios::binary);
    const auto counts = read<std::uint32_t>(file, 2);
    const auto positions = read<float>(file, 3 * std::size_t{counts[0]}),
               normals = read<float>(file, 3 * std::size_t{counts[0]});
    const auto indices = read<std::uint32_t>(file, counts[1]);
    if (!file || width <= 0 || height <= 0) return 3;

    const std::array<int, 11> wanted = {OSMESA_FORMAT,
                                        OSMESA_RGBA,
                                        OSMESA_DEPTH_BITS,
                                        24,
                                        OSMESA_PROFILE,
                                        OSMESA_CORE_PROFILE,
                                        OSMESA_CONTEXT_MAJOR_VERSION,
                                        4,
                                        OSMESA_CONTEXT_MINOR_VERSION,
                                        5,
                                        0};
    const OSMesaContext context = OSMesaCreateContextAttribs(wanted.data(), nullptr);
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::vector<std::uint32_t> window(pixels), picture(pixels);
    if (!context || !OSMesaMakeCurrent(context, window.data(), GL_UNSIGNED_BYTE, width, height)) return 4;

    GLuint array = 0;
    std::array<GLuint, 3> buffers{};
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glGenBuffers(3, buffers.data());
    const std::array<const std::vector<float>*, 2> attributes = {&positions, &normals};
    for (GLuint i = 0; i < 2; ++i) {
        glBindBuffer(GL_ARRAY_BUFFER, buffers[i]);
        glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(attributes[i]->size() * sizeof(float)),
                     attributes[i]->data(), GL_STATIC_DRAW);
        glVertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
        glEnableVertexAttribArray(i);
    }
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[2]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)),
                 indices.data(), GL_STATIC_DRAW);
    const GLuint program = glCreateProgram();
    glAttachShader(program, shader(GL_VERTEX_SHADER, kVertex));
    glAttachShader(program, shader(GL_FRAGMENT_SHADER, kFragment));
    glLinkProgram(program);
    glUseProgram(program);
    glViewport(0, 0, width, height);
    glEnable(GL_DEPTH_TEST);
    if (std::strcmp(argv[4], "front") == 0) glEnable(GL_CULL_FACE);
    glClearColor(0.3f, 0.4f, 0.5f, 1);
    std::printf("ready\n");
    std::fflush(stdout);

    std::array<float, 16> clip_T_world{};
    for (;;) {
        for (float& number : clip_T_world)
            if (std::scanf("%f", &number) != 1) return 0;
        const auto start = std::chrono::steady_clock::now();
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glUniformMatrix4fv(0, 1, GL_FALSE, clip_T_world.data());
        glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(indices.size()), GL_UNSIGNED_INT, nullptr);
        glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, picture.data());
        const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
        std::size_t covered = 0;  // that it has drawn at all
        for (const std::uint32_t pixel : picture) covered += pixel != picture.front() ? 1 : 0;
        std::printf("%.17g %zu\n", taken.count(), covered);
        std::fflush(stdout);
    }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::serve(argc, argv);
}
