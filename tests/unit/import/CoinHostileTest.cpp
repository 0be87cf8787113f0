// Files of VRML, X3D and Inventor that lie, bomb or end too early: each has its message, or is a scene.
#include <fmt/format.h>
#include <zlib.h>

#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

const std::string kVrmlHead = "#VRML V2.0 utf8\n";
const std::string kInventorHead = "#Inventor V2.1 ascii\n";
const std::string kThreeCorners = "coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0 ] } ";

std::string gzip(const std::string& text) {
    z_stream stream{};
    EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
    std::string packed(deflateBound(&stream, text.size()), '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    stream.avail_in = static_cast<uInt>(text.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

std::string repeated(const std::string& text, std::size_t times) {
    std::string all;
    for (std::size_t i = 0; i < times; ++i) all += text;
    return all;
}

std::string doubling(const char* begin, const char* each) {
    std::string text = begin;
    for (int i = 1; i < 40; ++i) text += fmt::format(fmt::runtime(each), i, i - 1);
    return text;
}

class CoinHostile : public testing::Test {
protected:
    /// What an error, or all notes, say.
    std::string said(const std::string& name, const std::string& text) {
        const Expected<ImportedScene> scene = importScene(scratch_.write(name, text), kRootNode, importOptions());
        if (!scene) return "error: " + scene.error().message;
        triangles_ = scene->triangles;
        return fmt::format("notes: {}", fmt::join(scene->notes, "\n"));
    }
    void expect(const std::string& name, const std::string& text) {
        const std::string answer = said(name, text);
        EXPECT_WORDS(answer) << name;
        EXPECT_EQ(answer.find("crashed"), std::string::npos) << name << " says: " << answer.substr(0, 500);
    }
    const Scratch scratch_;
    std::uint64_t triangles_ = 0;
};

TEST_F(CoinHostile, NestingIsBounded) {
    expect("a.wrl", kVrmlHead + repeated("Group { children [", 1'000'000));
    expect("b.iv", kInventorHead + repeated("Separator {", 900) + "Cube {}" + repeated("}", 900));
    expect("c.x3d", "<X3D><Scene>" + repeated("<Group>", 100'000) + repeated("</Group>", 100'000) + "</Scene></X3D>");
    expect("d.x3dv", "#X3D V3.0 utf8\n" + repeated("Group { children [", 100'000));
}

TEST_F(CoinHostile, MoreNodesThanTheirBytesBearAreRefused) {
    std::string kinds;
    for (int i = 0; i < 60'000; ++i) kinds += fmt::format("K{} {{}}\n", i);
    expect("kinds.wrl", kVrmlHead + kinds);
    expect("nodes.wrl", kVrmlHead + repeated("Group {}\n", 300'000));
}

TEST_F(CoinHostile, NothingMultipliesWithoutEnd) {
    expect("uses.wrl", kVrmlHead + doubling("DEF L0 Shape { geometry Box {} }\n",
                                            "DEF L{0} Group {{ children [ USE L{1} USE L{1} ] }}\n"));
    expect("protos.wrl", kVrmlHead +
                             doubling("PROTO P0 [] { Group {} }\n",
                                      "PROTO P{0} [] {{ Group {{ children [ P{1} {{}} P{1} {{}} ] }} }}\n") +
                             "P39 {}");
    expect("self.wrl", kVrmlHead + "PROTO A [] { Group { children A {} } } A {}");
    expect("cycle.wrl", kVrmlHead + "DEF A Group { children [ Shape { geometry Box {} } USE A ] }");
    expect("cycle.iv", kInventorHead + "DEF A Separator { Cube {} USE A }");
    // Coin went round and round in fields.
    expect("field.wrl", kVrmlHead + "DEF A Shape { appearance Appearance { material USE A } geometry Box {} }");
    EXPECT_EQ(triangles_, 12u);
    expect(
        "field.x3dv",
        "#X3D V3.0 utf8\nPROFILE Immersive\nDEF A Shape { appearance Appearance { material USE A } geometry Box {} }");
    expect(
        "field.x3d",
        R"(<X3D version="3.0" profile="Immersive"><Scene><Shape DEF="A"><Appearance><Material USE="A"/></Appearance>)"
        "<Box/></Shape></Scene></X3D>");
    expect("ended.wrl",
           kVrmlHead +
               "PROTO P [ field MFNode c [] ] { Transform { children IS c } } P { c [ DEF A Shape { appearance "
               "Appearance { material USE A ] Shape {} } } ] }");
    const std::string script =
        said("script.wrl", kVrmlHead +
                               "DEF A Group { children [ Shape { geometry Box {} } Script { field "
                               "SFNode me USE A } ] }");
    EXPECT_EQ(script.find("inside itself"), std::string::npos) << script;
    // The later one of a name is meant.
    const std::string again = kVrmlHead + "DEF A Group { children [ DEF A Shape { geometry Box {} } USE A ] }";
    EXPECT_EQ(said("again.wrl", again).find("inside itself"), std::string::npos);
    EXPECT_EQ(triangles_, 24u);
    expect("array.iv", kInventorHead + "Array { numElements1 30000 numElements2 30000 numElements3 30000 Cube {} }");
    expect("bomb.wrz", gzip(kVrmlHead + std::string(std::size_t{200} << 20, ' ')));
    expect("bomb.x3d", "<!DOCTYPE X3D [ <!ENTITY a \"aa\"> <!ENTITY b \"&a;&a;\"> ]><X3D><Scene/></X3D>");
    expect("prototypes.wrl", kVrmlHead + "EXTERNPROTO A [] \"prototypes.wrl#A\" A {} Shape { geometry Box {} }");
}

TEST_F(CoinHostile, NumbersThatLeadNowhereAreMended) {
    const auto shape = [](const std::string& geometry) { return kVrmlHead + "Shape { geometry " + geometry + " }"; };
    expect("a.wrl", shape("IndexedFaceSet { " + kThreeCorners +
                          "coordIndex [ 0 1 2 -1 0 1 99999999 -1 2147483647 -2147483648 -7 ] }"));
    EXPECT_EQ(triangles_, 1u);
    expect("b.wrl", shape("IndexedLineSet { " + kThreeCorners + "coordIndex [ 0 1 2 -1 0 77777777 ] }"));
    expect(
        "c.wrl",
        shape(
            "IndexedFaceSet { " + kThreeCorners +
            "coordIndex [ 0 1 2 -1 ] color Color { color 1 0 0 } colorIndex [ 5 70000000 9 ] "
            "normal Normal { vector 0 0 1 } normalIndex [ 5 70000000 -9 ] texCoord TextureCoordinate { point 0 0 } }"));
    expect("d.wrl", shape("ElevationGrid { xDimension 2000000000 zDimension 2000000000 height [ 0 1 2 ] }"));
    const std::string points = kInventorHead + "Coordinate3 { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }\n";
    for (const char* runs :
         {"FaceSet { numVertices [ 3, 4000000 ] }", "FaceSet { startIndex 2000000000 numVertices 3 }",
          "TriangleStripSet { numVertices 2000000000 }", "QuadMesh { verticesPerRow 99999 verticesPerColumn 99999 }",
          "LineSet { startIndex -7 numVertices 99999 }", "PointSet { startIndex -7 numPoints 1000000000 }"})
        expect("e.iv", points + runs);
    expect("f.iv",
           points +
               "Normal { vector 0 0 1 } TextureCoordinate2 { point 0 0 } MaterialBinding { value PER_VERTEX_INDEXED } "
               "IndexedFaceSet { coordIndex [ 0 1 2 -1 0 2 99 ] materialIndex [ 5 600000 7 ] normalIndex [ 5 6 ] }");
    expect("g.wrl", kVrmlHead + "Shape { geometry PointSet { coord Coordinate { point [ 1e39 0 0, 1 0 0 ] } } }");
    expect("h.wrl", kVrmlHead + "Transform { scale 1e30 1e30 1e30 children Shape { geometry Box {} } }");
    expect("i.wrl",
           kVrmlHead + "Shape { appearance Appearance { material Material { transparency 7 } } geometry Box {} }");
    expect("j.wrl", kVrmlHead + "Transform { translation nan 0 0 }");
}

TEST_F(CoinHostile, WhatIsNoSuchFileIsRefused) {
    expect("a.wrl", "");
    expect("b.wrl", "solid cube");
    expect("c.wrl", kVrmlHead);
    expect("d.wrz", gzip(kVrmlHead + "Shape { geometry Box {} }").substr(0, 40));
    expect("e.x3d", "<html/>");
    expect("f.x3d", "<X3D><Scene>");
    expect("g.x3dv", "#X3D V3.0 utf8\nShape { geometry ] }");
    expect("h.iv", "#Inventor V2.1 binary\n" + std::string(40, '\7'));
}

TEST_F(CoinHostile, FilesThatEndTooEarlyAreSaidToOrShown) {
    const std::string whole = kVrmlHead +
                              "DEF A Transform { children [ Shape { appearance Appearance { material Material { } } "
                              "geometry IndexedFaceSet { " +
                              kThreeCorners + "coordIndex [ 0 1 2 -1 ] } } USE A ] }\nROUTE A.translation TO A.scale\n";
    for (std::size_t length = 0; length < whole.size(); length += 9) {
        const std::string answer = said("cut.wrl", whole.substr(0, length));
        EXPECT_TRUE(answer.size() > 10 && answer.find("crashed") == std::string::npos) << length << ": " << answer;
    }
}

}  // namespace
}  // namespace tessera
