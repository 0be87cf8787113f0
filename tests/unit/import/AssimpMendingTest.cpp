/// Files that assimp itself finds fault with: what is sound of them is there, and the fault is said.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "common/cores/Skin.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

/// A triangle in Collada that two joints move, as parts that tests replace.
struct DaeFile {
    std::string joints = "Upper Lower", lower = "Lower", weights = "1 0.5 0.5", pairs = "0 0  0 1 1 2  1 0",
                counts = "1 2 1";

    [[nodiscard]] std::string text() const {
        const std::string unit = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
        return fmt::format(
            R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
            <asset><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#pa" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries>
<library_controllers><controller id="c"><skin source="#g"><bind_shape_matrix>{0}</bind_shape_matrix>
<source id="j"><Name_array id="ja" count="2">{1}</Name_array>
<technique_common><accessor source="#ja" count="2"><param name="JOINT" type="name"/></accessor></technique_common>
</source>
<source id="b"><float_array id="ba" count="32">{0} {0}</float_array>
<technique_common><accessor source="#ba" count="2" stride="16"><param name="TRANSFORM" type="float4x4"/></accessor>
</technique_common></source>
<source id="w"><float_array id="wa" count="3">{2}</float_array>
<technique_common><accessor source="#wa" count="3"><param name="WEIGHT" type="float"/></accessor></technique_common>
</source>
<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#b"/></joints>
<vertex_weights count="3"><input semantic="JOINT" source="#j" offset="0"/>
<input semantic="WEIGHT" source="#w" offset="1"/>
<vcount>{3}</vcount><v>{4}</v></vertex_weights>
</skin></controller></library_controllers>
<library_visual_scenes><visual_scene id="s"><node id="Upper" sid="Upper" name="Upper" type="JOINT">
<node id="{5}" sid="{5}" name="{5}" type="JOINT"/></node>
<node id="body"><instance_controller url="#c"><skeleton>#Upper</skeleton></instance_controller></node></visual_scene>
</library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)",
            unit, joints, weights, counts, pairs, lower);
    }
};

struct MendedFile {
    std::vector<std::string> notes;
    std::size_t triangles = 0, skins = 0;
    std::string error;
};
MendedFile readMended(const std::string& name, const std::string& text) {
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write(name, text), kRootNode, importOptions());
    if (!scene) return {.error = messageOf(scene)};
    MendedFile read{.notes = scene->notes, .triangles = scene->triangles};
    const ImportedAspect aspect(std::move(*scene));
    for (const ObjectId id : aspect->ids()) read.skins += aspect->get<Skin>(id) ? 1 : 0;
    return read;
}
bool saysFault(const MendedFile& read) {
    return std::ranges::any_of(read.notes, [](const std::string& note) {
        return note.find("assimp finds fault with it (") != std::string::npos;
    });
}
std::string everything(const MendedFile& read) {
    return fmt::format("{}\n{}", read.error, fmt::join(read.notes, "\n"));
}

TEST(AssimpMending, OfSoundFilesNothingIsSaid) {
    const MendedFile dae = readMended("sound.dae", DaeFile().text());
    EXPECT_EQ(dae.triangles, 1u) << everything(dae);
    EXPECT_EQ(dae.skins, 1u);
    EXPECT_FALSE(saysFault(dae)) << everything(dae);
}

TEST(AssimpMending, AJointThatIsNamedTwiceIsOneJoint) {
    const MendedFile dae = readMended("twice.dae", DaeFile{.joints = "Upper Upper"}.text());
    EXPECT_EQ(dae.triangles, 1u) << everything(dae);
    EXPECT_EQ(dae.skins, 1u);
    EXPECT_WORDS(everything(dae));
}

TEST(AssimpMending, WeightsThatAreAllZeroMoveNothing) {
    const MendedFile dae = readMended("none.dae", DaeFile{.weights = "0 0 0"}.text());
    EXPECT_EQ(dae.triangles, 1u) << everything(dae);
    EXPECT_WORDS(everything(dae));
}

TEST(AssimpMending, AnEmptyPartLeavesTheOthers) {
    const MendedFile stl = readMended("empty.stl",
                                      "solid nothing\nendsolid nothing\nsolid flag\n facet normal 0 0 1\n  outer "
                                      "loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
                                      "   vertex 0 1 0\n  endloop\n endfacet\nendsolid flag\n");
    EXPECT_EQ(stl.triangles, 1u) << everything(stl);
    EXPECT_WORDS(everything(stl));
}

TEST(AssimpMending, ALongNameOfASolidIsCut) {
    const MendedFile stl =
        readMended("long.stl", "solid " + std::string(100'000, 'x') +
                                   "\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
                                   "   vertex 0 1 0\n  endloop\n endfacet\nendsolid\n");
    EXPECT_EQ(stl.triangles, 1u) << everything(stl);
    EXPECT_WORDS(everything(stl));
}

/// Numbers of a sound and of two faulty files become others.
TEST(AssimpMending, WhateverIsChangedTheOutcomeIsASceneOrAMessageThatNamesTheFile) {
    const char* const only = std::getenv("TESSERA_SEED");
    const unsigned first = only ? static_cast<unsigned>(std::stoul(only)) : 1;
    std::size_t shown = 0;
    for (unsigned seed = first; seed < first + (only ? 1 : 100); ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_import --gtest_filter=AssimpMending.Whatever*", seed));
        std::mt19937 random(seed);
        const char* const joints[] = {"Upper Lower", "Upper Upper", "Lower Lower"};
        std::string text =
            DaeFile{.joints = joints[random() % 3], .weights = random() % 3 ? "1 0.5 0.5" : "0 0 0"}.text();
        std::vector<std::size_t> digits;
        for (std::size_t i = text.find("library_geometries"); i < text.size(); ++i)
            if (std::isdigit(static_cast<unsigned char>(text[i])) != 0) digits.push_back(i);
        const char* const others[] = {"0", "-1", "7", "65536", "4294967295", "1e30", "nan", ""};
        text.replace(digits[random() % digits.size()], 1, others[random() % std::size(others)]);
        const MendedFile read = readMended("changed.dae", text);
        shown += read.error.empty() ? 1 : 0;
        if (!read.error.empty()) {
            EXPECT_NE(read.error.find("/changed.dae: "), std::string::npos) << read.error;
        }
    }
    EXPECT_TRUE(only || shown > 20) << shown;
}

TEST(AssimpMending, OfDebiansModelsNoneIsRefusedForOneFault) {
    const std::string folder = "/usr/share/assimp/models/";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "models are missing (Debian package assimp-testmodels)";
    for (const char* name : {"OpenGEX/camera.ogex", "OpenGEX/collada.ogex", "RAW/WithColor.raw", "RAW/WithTexture.raw",
                             "STL/triangle_with_empty_solid.stl"}) {
        const Expected<ImportedScene> scene = importScene(folder + name, kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_GT(scene->triangles, 0u) << name;
    }
}

}  // namespace
}  // namespace tessera
