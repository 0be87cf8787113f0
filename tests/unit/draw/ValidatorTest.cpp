/// The programs that are put together, before glslangValidator, the reference compiler of GLSL (Debian's
/// glslang-tools): a driver takes what it likes, another one does not.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <random>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "client/draw/shaders/PersonPrograms.h"
#include "client/draw/shaders/Program.h"
#include "client/draw/store/DrawForms.h"
#include "client/draw/store/VolumeTextures.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;
using Use = ProgramKind::Use;

/// What the shell says and returns.
struct Ran {
    int status = -1;
    std::string said;
};
Ran run(const std::string& command) {
    Ran ran;
    std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
    if (!pipe) return ran;
    std::array<char, 4096> piece;
    for (std::size_t got = 0; (got = std::fread(piece.data(), 1, piece.size(), pipe)) > 0;)
        ran.said.append(piece.data(), got);
    ran.status = ::pclose(pipe);
    return ran;
}

/// What its messages say, without the names of files that it says with or without one.
std::string complaintsOf(const std::string& said) {
    std::istringstream lines(said);
    std::string complaints;
    for (std::string line; std::getline(lines, line);)
        if (line.find("ERROR") != std::string::npos || line.find("WARNING") != std::string::npos)
            complaints += line + '\n';
    return complaints;
}

/// Names with an underscore in conditions (`#if`) that nothing defines: a preprocessor takes them for 0.
std::set<std::string> unknownNamesOf(const std::string& text) {
    static const std::regex name("\\b[A-Z]+_[A-Z_]+\\b"), defined("defined\\(\\w+\\)");
    std::set<std::string> names;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("#if ") && !line.starts_with("#elif ")) continue;
        line = std::regex_replace(line, defined, "");
        for (std::sregex_iterator at(line.begin(), line.end(), name), end; at != end; ++at)
            if (text.find("#define " + at->str() + " ") == std::string::npos) names.insert(at->str());
    }
    return names;
}

/// Programs of persons: the numbers of ProgramKind::person are places here, and one.
const std::vector<PersonText>& persons() {
    static const std::vector<PersonText> texts = [] {
        const std::array<std::pair<const char*, const char*>, 3> own = {{
            {"void surface(inout Surface s) { s.base.rgb = fract(worldPosition + eyePosition * nodePosition); }", ""},
            {"uniform sampler2D picture;\nvoid surface(inout Surface s) { s.base *= texture(picture, uv); }",
             "uniform float swell;\nvoid vertex(inout vec3 p, inout vec3 n) { p += swell * n; }"},
            {"uniform vec3 tint;\nvoid surface(inout Surface s) {\n"
             "    for (int i = 0; i < 9; ++i) s.emissive += tint * uv1.x;\n}",
             "void vertex(inout vec3 p, inout vec3 n) { int i = 0; while (i < 3) p.x += float(++i) * uv.y; }"},
        }};
        std::vector<PersonText> made;
        for (const auto& [surface, vertex] : own) {
            auto text = preparePersonText(surface, vertex);
            EXPECT_TRUE(text) << text.error().message;
            if (text) made.push_back(std::move(*text));
        }
        return made;
    }();
    return texts;
}

/// A number of a ProgramKind, and the values that it may have.
struct Choice {
    std::size_t values;
    std::function<void(ProgramKind&, std::size_t value)> set;
};

template <typename Value>
Choice choice(Value ProgramKind::*member, std::vector<Value> values) {
    const std::size_t count = values.size();
    return {count,
            [member, values = std::move(values)](ProgramKind& kind, std::size_t i) { kind.*member = values[i]; }};
}

std::string nameOf(Use use) {
    static constexpr std::array kNames = {"surface", "clear",  "classify", "light_one", "light",   "rest",
                                          "meter",   "blend",  "copy",     "spread",    "resolve", "node_ids",
                                          "depth",   "plates", "farthest", "shadow"};
    return kNames.at(static_cast<std::size_t>(use));
}

bool drawsItems(Use use) {
    return use == Use::kSurface || use == Use::kBlend || use == Use::kNodeIds || use == Use::kShadow ||
           use == Use::kDepth;
}

/// What programs for one use differ in; see Renderer::Impl::kindOf.
std::vector<Choice> choicesOf(Use use) {
    std::vector<Choice> choices;
    const bool surface = use == Use::kSurface || use == Use::kBlend, cuts = drawsItems(use) && use != Use::kDepth;
    const auto flag = [&](bool ProgramKind::*member) { choices.push_back(choice<bool>(member, {false, true})); };
    if (drawsItems(use)) {
        // Which kind, and what it has in particular.
        std::vector<std::pair<MeshKind, std::uint8_t>> items;
        for (const DrawKindRow& row : kDrawKinds) {
            if ((use == Use::kShadow && !row.castsShadows) || (use == Use::kDepth && !row.hides)) continue;
            if (row.volume && use != Use::kBlend) continue;
            if (row.kind == MeshKind::kPoints) {
                for (std::uint8_t parts = 0; parts < 16; ++parts) items.emplace_back(row.kind, parts);
            } else if (row.kind == MeshKind::kMarched) {
                for (const std::uint8_t march : {kMarchCloud, kMarchShaded, kMarchMaximum})
                    for (const std::uint8_t each : {std::uint8_t{0}, kMarchEachSample})
                        items.emplace_back(row.kind, march | each);
            } else {
                items.emplace_back(row.kind, std::uint8_t{0});
            }
        }
        const std::size_t count = items.size();
        choices.push_back({count, [items = std::move(items)](ProgramKind& kind, std::size_t i) {
                               kind.items = items[i].first;
                               kind.pointParts = items[i].second;
                           }});
    }
    if (cuts) {
        std::vector<std::uint8_t> maps = {0, (1 << kImageMaps) - 1};
        for (std::size_t map = 0; map < kImageMaps; ++map) maps.push_back(static_cast<std::uint8_t>(1 << map));
        choices.push_back(choice<std::uint8_t>(&ProgramKind::maps, maps));
        if (use != Use::kBlend) flag(&ProgramKind::masked);
        choices.push_back({persons().size() + 1,
                           [](ProgramKind& kind, std::size_t i) { kind.person = static_cast<std::uint32_t>(i); }});
        flag(&ProgramKind::faceted);
    }
    if (surface) {
        // Each way to look up one layer, with another one as the third.
        choices.push_back({15, [](ProgramKind& kind, std::size_t i) {
                               const auto lookup = [](std::size_t at) { return static_cast<unsigned>(1 + at % 7); };
                               if (i > 0) kind.layers = static_cast<std::uint16_t>(lookup(i));
                               if (i > 7) kind.layers |= static_cast<std::uint16_t>(lookup(i + 3) << (2 * kLayerBits));
                           }});
    }
    if (surface) flag(&ProgramKind::tangents);
    if (use == Use::kSurface) {
        flag(&ProgramKind::large);
        flag(&ProgramKind::plain);
    }
    if (use == Use::kSurface || use == Use::kClear || use == Use::kClassify || (isLit(use) && use != Use::kBlend))
        flag(&ProgramKind::detail);
    if (isLit(use)) {
        flag(&ProgramKind::coated);
        flag(&ProgramKind::glossy);
        flag(&ProgramKind::scoped);
        flag(&ProgramKind::environment);
        choices.push_back(choice<LightLists>(&ProgramKind::lists, {kAllLightLists.begin(), kAllLightLists.end()}));
        if (use != Use::kBlend) flag(&ProgramKind::studio);
        flag(&ProgramKind::cubes);
        if (use != Use::kBlend) flag(&ProgramKind::oneSun);
        if (use != Use::kMeter) choices.push_back(choice<std::uint8_t>(&ProgramKind::toneMap, {0, 1, 2, 3, 4}));
    }
    choices.push_back(choice<int>(&ProgramKind::samples, {4, 1}));
    return choices;
}

/// One of those programs; nothing where no renderer asks for it.
std::optional<ProgramKind> kindOf(Use use, const std::vector<Choice>& choices, const std::vector<std::size_t>& values) {
    ProgramKind kind{.use = use};
    for (std::size_t i = 0; i < choices.size(); ++i) choices[i].set(kind, values[i]);
    const bool volume = drawsItems(use) && rowOf(kind.items).volume;
    const bool images = kind.maps != 0 || kind.layers != 0 || kind.masked || kind.person;
    if (volume && images) return std::nullopt;
    if ((kind.cubes || kind.oneSun) && kind.lists != LightLists::kShadows) return std::nullopt;
    if (kind.oneSun && (kind.cubes || kind.studio || kind.scoped)) return std::nullopt;
    const bool mapped = kind.items == MeshKind::kTriangles && (kind.maps & bitOf(ImageMap::kNormal)) != 0;
    if (kind.tangents && !mapped) return std::nullopt;
    if (kind.plain && images) return std::nullopt;
    if ((use == Use::kNodeIds || use == Use::kShadow) && kind.maps != 0 && !kind.masked && !kind.person)
        return std::nullopt;
    const bool ofSeveral = use == Use::kClassify || use == Use::kLight || use == Use::kLightRest ||
                           use == Use::kSpread || use == Use::kResolve || use == Use::kFarthest;
    if (ofSeveral && kind.samples == 1) return std::nullopt;
    if (kind.items == MeshKind::kMarched && (kind.pointParts & kMarchEachSample) != 0 && kind.samples == 1)
        return std::nullopt;
    kind.look = images || (use == Use::kBlend && !volume);
    return kind;
}

/// So that each value of each choice is met; or any two values that go together meet in one program (all pairs, as
/// combinatorial testing calls it): faults of conditions are mostly of two. A greedy cover by random programs.
enum class Cover { kValues, kPairs };
std::vector<ProgramKind> programsOf(Use use, Cover cover) {
    const std::vector<Choice> choices = choicesOf(use);
    using Meeting = std::array<std::size_t, 4>;
    const auto meetingsOf = [&](const std::vector<std::size_t>& values) {
        std::vector<Meeting> meetings;
        for (std::size_t b = 0; b < values.size(); ++b)
            for (std::size_t a = cover == Cover::kPairs ? 0 : b; a <= b; ++a)
                meetings.push_back({a, values[a], b, values[b]});
        return meetings;
    };
    std::mt19937 random(46);
    std::set<Meeting> met;
    std::vector<ProgramKind> kinds;
    // The best of a few, until many in a row bring nothing.
    for (int idle = 0; idle < 200;) {
        std::size_t most = 0;
        std::vector<std::size_t> best;
        for (int i = 0; i < 40; ++i) {
            std::vector<std::size_t> values;
            for (const Choice& c : choices) values.push_back(random() % c.values);
            if (!kindOf(use, choices, values)) continue;
            const auto meetings = meetingsOf(values);
            const auto fresh = static_cast<std::size_t>(
                std::ranges::count_if(meetings, [&](const Meeting& meeting) { return !met.contains(meeting); }));
            if (fresh <= most) continue;
            most = fresh;
            best = values;
        }
        if (most == 0) {
            ++idle;
            continue;
        }
        idle = 0;
        for (const Meeting& meeting : meetingsOf(best)) met.insert(meeting);
        kinds.push_back(*kindOf(use, choices, best));
    }
    return kinds;
}

class Validator : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(run("command -v glslangValidator").status, 0)
            << "glslangValidator is not installed (package glslang-tools; ./deploy/set-up installs it)";
        fs::create_directories(folder);
    }
    void TearDown() override { fs::remove_all(folder); }

    void write(const std::string& name, const std::string& text) const { std::ofstream(folder + "/" + name) << text; }
    /// In that folder.
    [[nodiscard]] Ran validate(const std::string& arguments) const {
        return run("cd '" + folder + "' && glslangValidator " + arguments);
    }

    const std::string folder = testing::TempDir() + "tessera-glsl." + std::to_string(::getpid());
};

// So that silence of the others says something.
TEST_F(Validator, FindsWhatIsWrong) {
    EXPECT_EQ(unknownNamesOf("#define LIGHTS_SUN 3\n#if LIGHTS == LIGHTS_SUN || defined(A_B)\n#elif A == LIGHTS_SUM\n"),
              std::set<std::string>{"LIGHTS_SUM"});
    write("a.vert", "#version 450 core\nout vec4 c;\nvoid main() { c = gl_Position = vec4(0.0); }\n");
    write("a.frag", "#version 450 core\nvoid main() { undeclared = 1.0; }\n");
    const Ran compiled = validate("a.vert a.frag");
    EXPECT_NE(compiled.status, 0);
    EXPECT_NE(complaintsOf(compiled.said), "");
    write("a.frag", "#version 450 core\nin vec3 c;\nout vec4 o;\nvoid main() { o = c.xyzz; }\n");
    EXPECT_EQ(validate("a.vert a.frag").status, 0);
    const Ran linked = validate("-l a.vert a.frag");
    EXPECT_NE(linked.status, 0);
    EXPECT_NE(complaintsOf(linked.said), "");
}

class ValidatorOf : public Validator, public testing::WithParamInterface<Use> {
protected:
    /// Writes the texts; gives their names, as so many pairs of files.
    [[nodiscard]] std::vector<std::string> write(const std::vector<ProgramKind>& kinds) const {
        std::vector<std::string> pairs;
        for (const ProgramKind& kind : kinds) {
            const PersonText* person = kind.person ? &persons().at(kind.person - 1) : nullptr;
            const ProgramText text = programText(kind, person);
            const std::string name = std::to_string(pairs.size());
            Validator::write(name + ".vert", text.vertex);
            Validator::write(name + ".frag", text.fragment);
            pairs.push_back(name + ".vert " + name + ".frag");
        }
        return pairs;
    }
};

TEST_P(ValidatorOf, TakesEveryStage) {
    std::string all;
    const std::vector<ProgramKind> kinds = programsOf(GetParam(), Cover::kPairs);
    const auto pairs = write(kinds);
    for (const std::string& pair : pairs) all += pair + ' ';
    const Ran compiled = validate(all);
    EXPECT_EQ(compiled.status, 0) << compiled.said;
    EXPECT_EQ(complaintsOf(compiled.said), "");
    // Conditions are the same in all of them.
    const ProgramText text = programText(kinds.front());
    EXPECT_EQ(unknownNamesOf(text.vertex), std::set<std::string>());
    EXPECT_EQ(unknownNamesOf(text.fragment), std::set<std::string>());
}

TEST_P(ValidatorOf, LinksStages) {
    for (const std::string& pair : write(programsOf(GetParam(), Cover::kValues))) {
        const Ran linked = validate("-l " + pair);
        EXPECT_EQ(linked.status, 0) << linked.said;
        EXPECT_EQ(complaintsOf(linked.said), "");
    }
}

INSTANTIATE_TEST_SUITE_P(Uses, ValidatorOf,
                         testing::Values(Use::kSurface, Use::kClear, Use::kClassify, Use::kLightOne, Use::kLight,
                                         Use::kLightRest, Use::kMeter, Use::kBlend, Use::kCopy, Use::kSpread,
                                         Use::kResolve, Use::kNodeIds, Use::kDepth, Use::kPlates, Use::kFarthest,
                                         Use::kShadow),
                         [](const testing::TestParamInfo<Use>& use) { return nameOf(use.param); });

}  // namespace
}  // namespace tessera
