// What of a person's GLSL never reaches a compiler, and what becomes of the rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <random>

#include "client/draw/shaders/PersonText.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

std::string surfaceOf(const std::string& before, const std::string& inside = {}) {
    return before + "void surface(inout Surface s) { " + inside + " }";
}
std::string problemOf(const std::string& surface, const std::string& vertex = {}) {
    const auto text = preparePersonText(surface, vertex);
    return text ? std::string() : text.error().message;
}

TEST(PersonText, NothingIsNothing) {
    const auto text = preparePersonText("", " \n\t// nothing\n");
    ASSERT_TRUE(text) << text.error().message;
    EXPECT_TRUE(text->surface.empty() && text->vertex.empty() && text->uniforms.empty());
}

TEST(PersonText, UniformsComeOutAndLinesStay) {
    const auto text = preparePersonText(
        "uniform vec3 tint;\nuniform sampler2D map;\nuniform\nfloat k;\n" + surfaceOf("", "s.base.rgb = k * tint;"),
        "");
    ASSERT_TRUE(text) << text.error().message;
    EXPECT_EQ(text->uniforms, (std::vector<PersonUniform>{{"tint", 3}, {"k", 1}, {"map", 0}}));
    EXPECT_EQ(text->numbers(), 2u);
    EXPECT_EQ(text->surface.find("uniform"), std::string::npos);
    EXPECT_EQ(std::count(text->surface.begin(), text->surface.end(), '\n'), 4);
    const auto both = preparePersonText("uniform float a;" + surfaceOf(""),
                                        "uniform float a;void vertex(inout vec3 p, inout vec3 n) { p *= a; }");
    ASSERT_TRUE(both) << both.error().message;
    EXPECT_EQ(both->uniforms.size(), 1u);
}

TEST(PersonText, LoopsHaveAnEnd) {
    const auto text = preparePersonText(
        surfaceOf("", "while (true) { for (;;) for (int i = 0; i < 3; ++i) ; do { } while (s.base.r < 2.0); }"), "");
    ASSERT_TRUE(text) << text.error().message;
    std::size_t counted = 0;
    for (std::size_t at = 0; (at = text->surface.find("tesseraRounds-- > 0", at)) != std::string::npos; ++at) ++counted;
    EXPECT_EQ(counted, 4u) << text->surface;
}

struct Hostile {
    const char* what;
    std::string surface;
};

TEST(PersonText, WhatReachesBeyondTheFunctionIsRefusedByItsNameAndLine) {
    const std::string nul("void surface(inout Surface s) {\n\0 }", 35);
    const Hostile hostile[] = {
        {"preprocessor", surfaceOf("\n#define x 1\n")},
        {"include", surfaceOf("#include \"/etc/passwd\"\n")},
        {"version", surfaceOf("#version 130\n")},
        {"pragma within", surfaceOf("", "\n#pragma optimize(off)\n")},
        {"a line that goes on", surfaceOf("int a = 1; \\\n")},
        {"layout", surfaceOf("layout(location = 3) out vec4 mine;\n")},
        {"output", surfaceOf("out vec4 mine;\n")},
        {"input", surfaceOf("\n\nin vec4 mine;\n")},
        {"fragment coordinates", surfaceOf("", "s.base.r = gl_FragCoord.x;")},
        {"depth", surfaceOf("", "gl_FragDepth = 1.0;")},
        {"after a number", surfaceOf("", "s.base.r = 1.*gl_FragCoord.x;")},
        {"image", surfaceOf("", "imageStore(x, ivec2(0), vec4(0));")},
        {"buffer", surfaceOf("buffer B { float x[]; };\n")},
        {"atomic", surfaceOf("", "atomicAdd(x, 1);")},
        {"shared", surfaceOf("shared float x;\n")},
        {"main", surfaceOf("void main() {}\n")},
        {"closes the function", surfaceOf("", "} void other() { } }")},
        {"closes nothing", "}" + surfaceOf("")},
        {"does not close", "void surface(inout Surface s) { ("},
        {"crossed", surfaceOf("", "( } )")},
        {"comment without end", surfaceOf("\n/* ")},
        {"a byte of nothing", nul},
        {"another alphabet", surfaceOf("", "float \xc3\xa9 = 1.0;")},
        {"the counter", surfaceOf("", "tesseraRounds = 1000000;")},
        {"two underscores", surfaceOf("float a__b;\n")},
        {"uniform block", surfaceOf("uniform Block { float x; };\n")},
        {"uniform array", surfaceOf("uniform float x[100000000];\n")},
        {"uniform with a value", surfaceOf("uniform float x = 1.0;\n")},
        {"uniform of two types", surfaceOf("uniform float x; uniform vec2 x;\n")},
        {"layout of a uniform", surfaceOf("const uniform float x;\n")},
        {"other samplers", surfaceOf("uniform usampler2D x;\n")},
        {"no function", "void other() {}"},
        {"while without", surfaceOf("", "while")},
        {"for without", surfaceOf("", "for (int i = 0; i < 3) ;")},
        {"for with three", surfaceOf("", "for (;;;) ;")},
        {"too long", surfaceOf(std::string(1 << 20, ' '))},
        {"too deep", surfaceOf("", std::string(100, '{') + std::string(100, '}'))},
        {"a long name", surfaceOf("float " + std::string(200, 'a') + ";")},
    };
    for (const Hostile& h : hostile) {
        const std::string problem = problemOf(h.surface);
        EXPECT_WORDS(problem) << h.what;
        EXPECT_TRUE(problem.starts_with("surface")) << problem;
    }
    EXPECT_TRUE(problemOf("", "void vertex(inout vec3 p, inout vec3 n) {\ngl_Position = vec4(0);}")
                    .starts_with("vertex, line 2: 'gl_Position'"));
    std::string many;
    for (int i = 0; i < 17; ++i) many += "uniform float u" + std::to_string(i) + ";";
    EXPECT_WORDS(problemOf(surfaceOf(many)));
    many.clear();
    for (int i = 0; i < 5; ++i) many += "uniform sampler2D u" + std::to_string(i) + ";";
    EXPECT_WORDS(problemOf(surfaceOf(many)));
}

TEST(PersonText, OrdinaryProgramsPass) {
    for (const char* text :
         {"struct Wave { float height; }; const float k = 2.0;\nfloat of(in Wave w, out float h) { h = w.height; "
          "return h; }\nvoid surface(inout Surface s) { "
          "float h; s.base.r = of(Wave(1.0), h); if (h > 2.0) discard; s.normal.xy += dFdx(uv) + fwidth(uv1); }",
          "void surface(inout Surface s) { for (int i = 0, j = 3; i < j; ++i) { if (i == 2) continue; s.base *= 0.5; } "
          "}",
          "void surface(inout Surface s) { switch (int(uv.x)) { case 0: break; default: s.roughness = 1.; } }"})
        EXPECT_EQ(problemOf(text), "") << text;
}

// Whatever bytes come, there is an answer, and what passes has neither a '#' nor a loop without its end.
TEST(PersonText, AnyBytesHaveAnAnswer) {
    const char* seeds = std::getenv("TESSERA_SEED");
    const unsigned first = seeds ? static_cast<unsigned>(std::atoi(seeds)) : 1, count = seeds ? 1 : 20;
    const char* pieces[] = {"void surface(inout Surface s)",
                            "{",
                            "}",
                            "(",
                            ")",
                            "while",
                            "for",
                            "(;;)",
                            "uniform",
                            "float",
                            "x",
                            ";",
                            "//",
                            "/*",
                            "*/",
                            "\n",
                            "#",
                            "1.0",
                            ".",
                            "do",
                            "=",
                            "[",
                            "]",
                            "gl_X",
                            "\\",
                            "sampler2D"};
    for (unsigned seed = first; seed < first + count; ++seed) {
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) +
                     " build/bin/unit_draw --gtest_filter=PersonText.AnyBytesHaveAnAnswer");
        std::mt19937 random(seed);
        for (int i = 0; i < 2000; ++i) {
            std::string text;
            for (unsigned k = random() % 40; k > 0; --k) {
                if (random() % 20 == 0)
                    text += static_cast<char>(random() % 256);
                else
                    text += std::string(pieces[random() % std::size(pieces)]) + (random() % 2 ? " " : "");
            }
            const auto prepared = preparePersonText(text, {});
            if (!prepared) {
                ASSERT_TRUE(prepared.error().message.starts_with("surface")) << prepared.error().message;
                continue;
            }
            ASSERT_EQ(prepared->surface.find('#'), std::string::npos);
            for (std::size_t at = 0; (at = prepared->surface.find("gl_", at)) != std::string::npos; ++at)
                ASSERT_TRUE(at > 0 && (std::isalnum(static_cast<unsigned char>(prepared->surface[at - 1])) ||
                                       prepared->surface[at - 1] == '_'))
                    << prepared->surface;
        }
    }
}

TEST(PersonText, CompilersWordsComeWithThePersonsLines) {
    EXPECT_EQ(personProblem("0:1000003(12): error: `x' undeclared\n0:1000003(12): error: more"),
              "surface, line 3: `x' undeclared");
    EXPECT_EQ(personProblem("the surface refuses a shader: 0:2000012(1): error: syntax error"),
              "vertex, line 12: syntax error");
    EXPECT_EQ(personProblem("0(1000005) : error C1008: undefined variable \"x\""),
              "surface, line 5: error C1008: undefined variable \"x\"");
    EXPECT_EQ(personProblem("ERROR: 0:1000004: 'x' : undeclared identifier"),
              "surface, line 4: 'x' : undeclared identifier");
    EXPECT_WORDS(personProblem("0:120(3): error: `light' redefined"));
    EXPECT_NE(personProblem(""), "");
}

}  // namespace
}  // namespace tessera
