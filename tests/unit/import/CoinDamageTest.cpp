/// VRML, X3D and Inventor with bytes that are others: a scene that is sound, or words. Each hundred of them in a
/// process of their own, which Coin may not take down either.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <vector>

#include "server/import/coin/CoinReader.h"
#include "tests/unit/import/Damage.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

constexpr std::string_view kLettersOfCoin = "0123456789-+.eE/ \n\r\t#\\{}[],\"<>='&DEFUSIproto";

std::string inventorInBytes() {
    const auto word = [](std::uint32_t number) {
        number = __builtin_bswap32(number);
        return std::string(reinterpret_cast<const char*>(&number), sizeof(number));
    };
    const auto name = [&](std::string_view letters) {
        std::string bytes = word(static_cast<std::uint32_t>(letters.size())) + std::string(letters);
        bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
        return bytes;
    };
    const auto node = [&](std::string_view kind, std::string_view field, const std::string& value) {
        return name(kind) + word(0) + word(1) + name(field) + value + word(0);
    };
    std::string places = word(4), corners = word(8);
    for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 1.f, 1.f, 0.f})
        places += word(std::bit_cast<std::uint32_t>(x));
    for (const int corner : {0, 1, 2, -1, 1, 3, 2, -1}) corners += word(static_cast<std::uint32_t>(corner));
    return "#Inventor V2.1 binary  \n" + name("Separator") + word(0) + word(0) + word(5) +
           node("Coordinate3", "point", places) + node("IndexedFaceSet", "coordIndex", corners) +
           node("Cube", "width", word(std::bit_cast<std::uint32_t>(3.f))) +
           node("Texture2", "image", word(2) + word(1) + word(4) + word(0xff00ff80) + word(0x01020304)) +
           node("Text2", "string", word(2) + name("one") + name("two"));
}

struct WholeFile {
    const char* file;
    std::string bytes;
};
const std::vector<WholeFile> kWholeFiles = {
    {"a.wrl",
     "#VRML V2.0 utf8\nPROTO P [ field SFVec3f at 1 2 3 field MFNode c [] ] { Transform { translation IS at children "
     "IS c } }\nDEF T TimeSensor { cycleInterval 4 loop TRUE }\nDEF I PositionInterpolator { key [ 0 0.5 1 ] keyValue "
     "[ 0 0 0, 1 1 1, 0 0 0 ] }\nDEF X Transform { rotation 0 1 0 0.5 children [ P { at 0 1 0 c [ DEF S Shape { "
     "appearance Appearance { material Material { diffuseColor 1 0 0 } texture PixelTexture { image 1 2 3 0xff0000 "
     "0x0000ff } textureTransform TextureTransform { scale 3 1 } } geometry IndexedFaceSet { creaseAngle 1 coord "
     "DEF C Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] } coordIndex [ 0 1 2 3 -1 0 2 1 ] color Color { color [ "
     "1 0 "
     "0, 0 1 0 ] } colorPerVertex FALSE texCoord TextureCoordinate { point [ 0 0, 1 0, 1 1 ] } texCoordIndex [ 0 1 2 "
     "0 -1 0 1 2 ] } } ] } USE S ] }\nShape { geometry Extrusion { crossSection [ 1 0, 0 1, -1 0, 1 0 ] spine [ 0 0 0, "
     "0 1 0, 1 2 0 ] scale [ 1 1, 2 2 ] } }\nShape { geometry ElevationGrid { xDimension 2 zDimension 3 height [ 0 1 "
     "2 3 4 5 ] } }\nLOD { range [ 5 ] level [ Shape { geometry Box {} } Group {} ] }\nSwitch { whichChoice 0 choice "
     "USE S }\nShape { geometry Text { string [ \"a\" \"b\" ] } }\nViewpoint { description \"v\" }\nROUTE "
     "T.fraction_changed TO I.set_fraction\nROUTE I.value_changed TO X.set_translation\nDEF J CoordinateInterpolator { "
     "key [ 0 0.5 1 ] keyValue [ 0 0 0, 1 0 0, 1 1 0, 0 1 0, 0 0 1, 1 0 0, 1 1 2, 0 1 0, 0 0 0, 2 0 0, 1 1 0, 0 3 0 ] "
     "}\nROUTE T.fraction_changed TO J.set_fraction\nROUTE J.value_changed TO C.point\n"},
    {"a.x3d",
     "<?xml version=\"1.0\"?><X3D><Scene><ProtoDeclare name='P'><ProtoInterface><field name='s' type='SFVec3f' "
     "accessType='initializeOnly' value='1 1 1'/></ProtoInterface><ProtoBody><Transform><IS><connect "
     "nodeField='scale' protoField='s'/></IS><Shape><Box/></Shape></Transform></ProtoBody></ProtoDeclare>"
     "<ProtoInstance name='P'><fieldValue name='s' value='2 1 1'/></ProtoInstance><Transform DEF='X'><Shape DEF='S'>"
     "<Appearance><Material diffuseColor='1 0 0'/></Appearance><IndexedTriangleSet index='0 1 2 1 3 2'><Coordinate "
     "DEF='C' point='0 0 0 1 0 0 0 1 0 1 1 0'/></IndexedTriangleSet></Shape><Shape><TriangleStripSet stripCount='4'>"
     "<Coordinate USE='C'/></TriangleStripSet></Shape><Shape><LineSet vertexCount='2 2'><Coordinate USE='C'/>"
     "</LineSet></Shape><Shape USE='S'/><Shape><Text string='\"a\" \"b\"'/></Shape><Shape><Disk2D/></Shape>"
     "</Transform><TimeSensor DEF='T'/><ROUTE fromNode='T' fromField='a' toNode='X' toField='b'/></Scene></X3D>"},
    {"a.x3dv",
     "#X3D V3.2 utf8\nPROFILE Interchange\nMETA \"a\" \"b\"\nPROTO P [ inputOutput SFVec3f s 1 1 1 ] { Transform { "
     "scale IS s children [ Shape { geometry Box {} } ] } }\nP { s 2 1 1 }\nDEF X Transform { children [ DEF S Shape { "
     "appearance Appearance { material Material { diffuseColor 1 0 0 } } geometry QuadSet { coord Coordinate { point "
     "[ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] } } } Shape { geometry Polyline2D { lineSegments [ 0 0, 1 1 ] } } USE S ] }\n"},
    {"a.iv",
     "#Inventor V2.1 ascii\nSeparator { DEF M Material { diffuseColor [ 1 0 0, 0 1 0 ] } MaterialBinding { value "
     "PER_FACE } Coordinate3 { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0, 0 0 1, 2 2 2 ] } Normal { vector [ 0 0 1, 0 1 0 ] "
     "} NormalBinding { value PER_FACE } IndexedFaceSet { coordIndex [ 0,1,2,3,-1,0,1,4,-1 ] materialIndex [ 0,1 ] } "
     "FaceSet { numVertices [ 3,3 ] } TriangleStripSet { numVertices 4 } QuadMesh { verticesPerRow 2 "
     "verticesPerColumn 3 } PointSet { numPoints 3 } LineSet { numVertices 3 } Texture2 { image 2 1 3 0xff0000 0xff "
     "} TextureCoordinate2 { point [ 0 0, 1 0, 1 1 ] } Transform { translation 1 2 3 rotation 0 1 0 1 } Cube {} "
     "Text3 { string \"a\" } Array { numElements1 3 Cone {} } MultipleCopy { matrix [ 1 0 0 0 0 1 0 0 0 0 1 0 5 0 0 1 "
     "] Cylinder {} } Switch { whichChild 0 USE M } LevelOfDetail { screenArea 100 Cube {} } PerspectiveCamera {} "
     "DirectionalLight {} Coordinate4 { point [ 0 0 0 1,1 0 0 1,0 1 0 1,1 1 0 1 ] } NurbsSurface { numUControlPoints 2 "
     "numVControlPoints 2 uKnotVector [ 0 0 1 1 ] vKnotVector [ 0 0 1 1 ] } }\n"},
    {"b.iv", inventorInBytes()},
};

std::string faultInNodes(const PlainScene& scene, const google::protobuf::RepeatedPtrField<proto::scene::Node>& nodes) {
    for (const proto::scene::Node& node : nodes) {
        if (std::string fault = faultInNodes(scene, node.node()); !fault.empty()) return fault;
        if (!node.has_skin()) continue;
        const auto mesh = std::ranges::find(scene.file.mesh(), node.skin().mesh(), &proto::scene::Mesh::name);
        if (mesh == scene.file.mesh().end()) return "a skin without a mesh";
        const std::size_t each = scene.blobs.at(mesh->positions_blob() - 1).size();
        const auto targets = static_cast<std::size_t>(node.skin().weight_size());
        if (scene.blobs.at(node.skin().morph_positions_blob() - 1).size() != targets * each) return "a skin's targets";
    }
    return {};
}

std::string faultInScene(const PlainScene& scene) {
    if (std::string fault = faultInNodes(scene, scene.file.node()); !fault.empty()) return fault;
    for (const proto::scene::Mesh& mesh : scene.file.mesh()) {
        const auto bytesOf = [&](std::uint32_t blob) { return blob == 0 ? 0 : scene.blobs.at(blob - 1).size(); };
        const std::size_t vertices = bytesOf(mesh.positions_blob()) / 12;
        if (vertices == 0) return "a mesh without vertices";
        if (mesh.normals_blob() != 0 && bytesOf(mesh.normals_blob()) != 12 * vertices) return "a vertex's normal";
        if (mesh.texcoords_blob() != 0 && bytesOf(mesh.texcoords_blob()) != 8 * vertices) return "a vertex's uv";
        if (mesh.indices_blob() == 0) continue;
        const Bytes& indices = scene.blobs.at(mesh.indices_blob() - 1);
        for (std::size_t at = 0; at < indices.size(); at += 4) {
            std::uint32_t index = 0;
            std::memcpy(&index, indices.data() + at, sizeof(index));
            if (index >= vertices) return "an index that names no vertex";
        }
    }
    return {};
}

/// In a process of its own, which may take two seconds and 2 GiB: what is wrong, else nothing.
std::string faultOfSeeds(const WholeFile& whole, const Scratch& scratch, unsigned first, unsigned end) {
    const pid_t child = ::fork();
    if (child == 0) {
        const rlimit seconds{2, 3}, bytes{std::size_t{2} << 30, std::size_t{2} << 30};
        ::setrlimit(RLIMIT_CPU, &seconds);
        if (!kSanitized) ::setrlimit(RLIMIT_AS, &bytes);
        for (unsigned seed = first; seed < end; ++seed) {
            const std::string path = scratch.write(whole.file, damaged(whole.bytes, kLettersOfCoin, seed));
            const Expected<PlainScene> scene = readWithCoin(path, {});
            if (scene ? !faultInScene(*scene).empty() : scene.error().message.empty()) ::_exit(1);
        }
        ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    if (WIFSIGNALED(status)) return fmt::format("signal {}", WTERMSIG(status));
    return WEXITSTATUS(status) == 0 ? "" : "an unsound scene, or an error without words";
}

class CoinDamage : public testing::TestWithParam<WholeFile> {};

TEST_P(CoinDamage, LeadsToASceneOrWords) {
    static const bool kReady = (prepareCoin(), true);
    ASSERT_TRUE(kReady);
    const Scratch scratch;
    const Seeds seeds;
    constexpr unsigned kAtOnce = 50;
    for (unsigned seed = seeds.first; seed < seeds.end; seed += kAtOnce) {
        const unsigned end = std::min(seed + kAtOnce, seeds.end);
        if (faultOfSeeds(GetParam(), scratch, seed, end).empty()) continue;
        for (unsigned one = seed; one < end; ++one)
            if (const std::string fault = faultOfSeeds(GetParam(), scratch, one, one + 1); !fault.empty())
                ADD_FAILURE() << "TESSERA_SEED=" << one << " --gtest_filter=*CoinDamage*: " << fault;
    }
}

INSTANTIATE_TEST_SUITE_P(Of, CoinDamage, testing::ValuesIn(kWholeFiles), [](const auto& test) {
    std::string name = test.param.file;
    name[1] = '_';
    return name;
});

}  // namespace
}  // namespace tessera
