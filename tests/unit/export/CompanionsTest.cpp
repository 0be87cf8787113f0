/// Files beside the one that was asked for: whose they are, and what happens to those of others.
#include <fcntl.h>
#include <sys/syscall.h>

#include "common/cores/DirectionalLight.h"
#include "common/cores/Image.h"
#include "common/cores/PointLight.h"
#include "common/export/UniqueNames.h"
#include "tests/support/words/Words.h"
#include "tests/unit/base/ForbiddenCalls.h"
#include "tests/unit/export/BuiltScene.h"
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

std::string textOf(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// A metal triangle with a grey picture of colour, and with one that makes it a rough half-metal.
Aspect pictured(int pictures, const Material& like = {}) {
    BuiltScene built;
    Material material = like;
    for (int i = 0; i < pictures; ++i) {
        Image image;
        image.pixels = blobOf<std::uint8_t>({static_cast<std::uint8_t>(100 + i), 204, 51, 255});
        image.widthPx = image.heightPx = 1;
        (i == 0   ? material.baseColorImage
         : i == 1 ? material.metallicRoughnessImage
                  : material.emissiveImage) = built.add(image);
    }
    Geometry geometry = triangleGeometry();
    geometry.texcoords = blobOf<float>({0, 0, 1, 0, 0, 1});
    geometry.material = built.add(material);
    built.node("chair", built.add(geometry));
    return built.take();
}

TEST(Companions, OfSeveralFormatsStandBesideEachOther) {
    const Scratch scratch;
    const Aspect scene = pictured(3);
    std::set<std::string> all;
    std::map<std::string, std::string> contents;
    for (const char* ending : {"usda", "wrl", "obj", "gltf"}) {
        const Expected<ExportReport> report = exportScene(scratch.path(std::string("chair.") + ending), scene);
        ASSERT_TRUE(report) << report.error().message;
        for (const std::string& file : report->files) {
            EXPECT_TRUE(all.insert(file).second) << file;
            contents[file] = textOf(file);
        }
    }
    for (const auto& [file, content] : contents) EXPECT_EQ(textOf(file), content) << file;
    EXPECT_TRUE(all.contains(scratch.path("chair.usda.0.png")) && all.contains(scratch.path("chair.gltf.bin")));
}

TEST(Companions, AFileOfAPersonsIsNeverOverwritten) {
    const std::pair<const char*, const char*> theirs[] = {{"chair.usda", "chair.usda.0.png"},
                                                          {"chair.wrl", "chair.wrl.0.png"},
                                                          {"chair.obj", "chair.obj.mtl"},
                                                          {"chair.gltf", "chair.gltf.bin"}};
    for (const auto& [out, beside] : theirs) {
        const Scratch scratch;
        const std::string kept = scratch.write(beside, "mine"), path = scratch.write(out, "old");
        for (const char* other : {"chair.mtl", "chair.bin", "chair.0.png"}) (void)scratch.write(other, "mine");
        const Expected<ExportReport> refused = exportScene(path, pictured(3));
        ASSERT_FALSE(refused) << out;
        EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
        EXPECT_EQ(refused.error().message.find(kept + ": this file is there"), 0u) << refused.error().message;
        EXPECT_EQ(textOf(kept), "mine");
        EXPECT_EQ(textOf(path), "old");
        fs::remove(kept);
        ASSERT_TRUE(exportScene(path, pictured(3))) << out;
        for (const char* other : {"chair.mtl", "chair.bin", "chair.0.png"})
            EXPECT_EQ(textOf(scratch.path(other)), "mine");
    }
}

TEST(Companions, TheNextSaveReplacesItsOwnAndRemovesWhatIsLeftOver) {
    for (const char* out : {"chair.usda", "chair.obj"}) {
        const Scratch scratch;
        const std::string path = scratch.path(out);
        ASSERT_TRUE(exportScene(path, pictured(3)));
        (void)scratch.write(std::string(out) + ".7.png", "mine");
        const Expected<ExportReport> again = exportScene(path, pictured(1));
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_TRUE(fs::exists(path + ".0.png"));
        EXPECT_FALSE(fs::exists(path + ".1.png") || fs::exists(path + ".2.png")) << out;
        EXPECT_EQ(textOf(path + ".7.png"), "mine");
    }
}

TEST(Companions, AListThatAnotherHandWroteLeadsNowhere) {
    const Scratch scratch;
    const std::string kept = scratch.write("chair.usda.txt", "mine");
    const std::string path =
        scratch.write("chair.usda", "#usda 1.0\n# written by Tessera, beside it: txt ../x .png 0.png/../txt\n");
    ASSERT_TRUE(exportScene(path, pictured(1)));
    EXPECT_EQ(textOf(kept), "mine");
}

TEST(Companions, ALinkBesideIsReplacedAndNotFollowed) {
    // As an archive from a stranger may have it: a file of ours, and a link where one that it lists should be.
    const Scratch scratch;
    const std::string path = scratch.path("chair.usda"), mine = scratch.write("mine.txt", "mine");
    const Expected<ExportReport> first = exportScene(path, pictured(1));
    ASSERT_TRUE(first);
    ASSERT_GT(first->files.size(), 1u);
    const std::string picture = first->files.front();
    fs::remove(picture);
    fs::create_symlink(mine, picture);
    ASSERT_TRUE(exportScene(path, pictured(1)));
    EXPECT_EQ(textOf(mine), "mine");
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(picture)));
}

TEST(Companions, ALinkToNothingYetIsFollowed) {
    const Scratch scratch;
    const std::string path = scratch.path("link.stl");
    fs::create_directory(scratch.path("far"));
    fs::create_symlink("far/chair.stl", path);
    ASSERT_TRUE(exportScene(path, pictured(0)));
    EXPECT_TRUE(fs::is_symlink(path));
    EXPECT_TRUE(fs::is_regular_file(scratch.path("far/chair.stl")));
    fs::create_symlink("b.stl", scratch.path("a.stl"));
    fs::create_symlink("a.stl", scratch.path("b.stl"));
    EXPECT_FALSE(exportScene(scratch.path("a.stl"), pictured(0)));
}

TEST(Companions, ThroughALinkLieBesideTheRealFileAndHaveItsName) {
    for (const char* ending : {"gltf", "usda", "wrl", "obj"}) {
        const Scratch scratch;
        const std::string path = scratch.path(std::string("link.") + ending);
        const std::string real = fmt::format("far/real.{}", ending);
        fs::create_directory(scratch.path("far"));
        fs::create_symlink(real, path);
        const auto namesIn = [&](const std::string& folder) {
            std::set<std::string> names;
            for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
            return names;
        };
        // First the link leads to nothing yet.
        for (const int pictures : {3, 1}) {
            const Expected<ExportReport> report = exportScene(path, pictured(pictures));
            ASSERT_TRUE(report) << report.error().message;
            EXPECT_EQ(report->files.back(), path);
            const std::set<std::string> names = namesIn(scratch.path("far"));
            EXPECT_EQ(names.size(), report->files.size()) << ending;
            for (const std::string& name : names) EXPECT_TRUE(name.starts_with(real.substr(4))) << name;
            EXPECT_EQ(namesIn(scratch.path("")), (std::set<std::string>{"far", fs::path(path).filename().string()}));
            const ImportedAspect again = readBack(scratch.path(real));
            std::size_t images = 0;
            for (const ObjectId id : again->ids()) images += again->get<Image>(id) != nullptr ? 1 : 0;
            EXPECT_GE(images, 1u) << ending;
        }
    }
}

/// Pictures come first: those of a new save must not stand beside the old scene.
TEST(Companions, StayWhereALaterFileOfTheSaveGetsNoName) {
    const Scratch scratch;
    const std::string path = scratch.path("chair.usda");
    Material red;
    red.baseColor = Vec4f(1, 0, 0, 1);
    ASSERT_TRUE(exportScene(path, pictured(1)));
    std::map<std::string, std::string> before;
    for (const auto& entry : fs::directory_iterator(scratch.path(""))) before[entry.path()] = textOf(entry.path());
    const Aspect next = pictured(3, red);
    const int status = elsewhere([&] {
        const int fd = ::open(scratch.path("").c_str(), O_RDWR | O_TMPFILE | O_CLOEXEC, 0600);
        if (fd < 0) ::_exit(kCannotForbid);
        // Files are copied then, which works for small ones: not for the scene.
        forbid(SYS_linkat, EPERM);
        forbid(SYS_sendfile, ENOSPC, 3, 500);
        const Expected<ExportReport> report = exportScene(path, next);
        ::_exit(!report && report.error().message.find("No space left") != std::string::npos ? 0 : 1);
    });
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == kCannotForbid) GTEST_SKIP() << "no seccomp, or no files without names here";
    EXPECT_EQ(WEXITSTATUS(status), 0);
    std::map<std::string, std::string> after;
    for (const auto& entry : fs::directory_iterator(scratch.path(""))) after[entry.path()] = textOf(entry.path());
    EXPECT_EQ(after, before);
}

/// The tenth one's name is a byte longer than the first one's.
TEST(Companions, WithNamesThatAreTooLongReplaceNothing) {
    const Scratch scratch;
    const auto manyPictures = [](int pictures, std::uint8_t blue) {
        BuiltScene built;
        for (int i = 0; i < pictures; ++i) {
            Image image;
            image.pixels = blobOf<std::uint8_t>({static_cast<std::uint8_t>(i), 204, blue, 255});
            image.widthPx = image.heightPx = 1;
            Material material;
            material.baseColorImage = built.add(image);
            Geometry geometry = triangleGeometry();
            geometry.texcoords = blobOf<float>({0, 0, 1, 0, 0, 1});
            geometry.material = built.add(material);
            built.node("chair", built.add(geometry));
        }
        return built.take();
    };
    const std::string path = scratch.path(std::string(244, 'n') + ".usda");  // ".9.png" makes 255
    ASSERT_TRUE(exportScene(path, manyPictures(10, 0)));
    std::map<std::string, std::string> before;
    for (const auto& entry : fs::directory_iterator(scratch.path(""))) before[entry.path()] = textOf(entry.path());
    EXPECT_EQ(before.size(), 11u);
    const Expected<ExportReport> report = exportScene(path, manyPictures(11, 255));
    ASSERT_FALSE(report);
    EXPECT_WORDS(report.error().message);
    std::map<std::string, std::string> after;
    for (const auto& entry : fs::directory_iterator(scratch.path(""))) after[entry.path()] = textOf(entry.path());
    EXPECT_EQ(after, before);
}

TEST(UniqueNames, AreCountedOnForEachName) {
    UniqueNames names("_");
    EXPECT_EQ(names.take("a"), "a");
    EXPECT_EQ(names.take("a_2"), "a_2");
    EXPECT_EQ(names.take("a"), "a_3");
    EXPECT_EQ(names.take("a"), "a_4");
}

/// Counting from 2 for each would take thousands of millions of looks.
TEST(UniqueNames, OfManyEqualSiblingsAreFoundAtOnce) {
    const Scratch scratch;
    BuiltScene built;
    for (int i = 0; i < 60'000; ++i) built.node(i % 2 == 0 ? "" : "bolt");
    const Aspect scene = built.take();
    for (const char* out : {"many.usda", "many.wrl"}) ASSERT_TRUE(exportScene(scratch.path(out), scene));
}

TEST(ExportedLights, ComeBackAsStrongAsTheyWere) {
    const Scratch scratch;
    BuiltScene built;
    PointLight lamp;
    lamp.color = Vec3f(1, 0.5f, 0.25f);
    lamp.intensity = 3.5f;
    built.node("lamp", built.add(lamp));
    DirectionalLight sun;
    sun.intensity = 0.75f;
    built.node("sun", built.add(sun));
    built.node("triangle", built.add(triangleGeometry()));
    const Aspect scene = built.take();
    for (const char* out : {"out.usda", "out.wrl"}) {
        ASSERT_TRUE(exportScene(scratch.path(out), scene));
        const ImportedAspect again = readBack(scratch.path(out));
        const bool vrml = std::string_view(out) == "out.wrl";
        int found = 0;
        for (const ObjectId id : again->ids()) {
            if (const auto* read = again->get<PointLight>(id)) {
                const Vec3f expected = (vrml ? 1.0f : 3.5f) * Vec3f(1, 0.5f, 0.25f);
                EXPECT_TRUE((read->color * read->intensity).isApprox(expected, 1e-3f)) << out << read->intensity;
                ++found;
            } else if (const auto* shine = again->get<DirectionalLight>(id)) {
                EXPECT_NEAR(shine->intensity * shine->color[0], 0.75f, 1e-4f) << out;
                ++found;
            }
        }
        EXPECT_EQ(found, 2) << out;
    }
}

TEST(ExportedLooks, OfVrmlHaveTheMeanOfPicturesThatStayBehind) {
    const Scratch scratch;
    Material metal;
    metal.metallic = metal.roughness = 1;
    metal.emissive = Vec3f::Ones();
    ASSERT_TRUE(exportScene(scratch.path("chair.wrl"), pictured(3, metal)));
    const std::string text = textOf(scratch.path("chair.wrl"));
    EXPECT_EQ(text.find("emissiveColor 1 1 1"), std::string::npos);
    EXPECT_EQ(text.find("specularColor 1 1 1"), std::string::npos);
    EXPECT_NE(text.find("shininess 0.19"), std::string::npos) << text;  // 1 - 204 / 255
}

std::vector<std::uint8_t> bytesOf(const Image* image) {
    const auto bytes = image ? image->pixels.as<std::uint8_t>() : std::span<const std::uint8_t>();
    return {bytes.begin(), bytes.end()};
}

/// A picture of colours replaces the material's there.
TEST(ExportedLooks, OfVrmlHaveTheirColourInTheirPictures) {
    const Scratch scratch;
    BuiltScene built;
    Image image;
    image.pixels = blobOf<std::uint8_t>({255, 204, 51, 255, 255, 204, 51, 128});
    image.widthPx = 2;
    image.heightPx = 1;
    Image opaque = image;
    opaque.pixels = blobOf<std::uint8_t>({255, 204, 51, 255, 255, 204, 51, 255});
    const auto wear = [&](const char* name, const Image& worn, const Vec4f& color, bool unlit) {
        Material material;
        material.baseColor = color;
        material.baseColorImage = built.add(worn);
        material.alphaMode = color[3] < 1 ? Material::kBlend : Material::kOpaque;
        material.unlit = unlit;
        Geometry geometry = triangleGeometry();
        geometry.texcoords = blobOf<float>({0, 0, 1, 0, 0, 1});
        geometry.material = built.add(material);
        built.node(name, built.add(geometry));
    };
    wear("red", opaque, Vec4f(1, 0.1f, 0.1f, 1), false);
    wear("white", opaque, Vec4f(1, 1, 1, 1), false);
    wear("glass", opaque, Vec4f(1, 0.1f, 0.1f, 0.5f), false);
    wear("veil", image, Vec4f(1, 1, 1, 0.5f), false);
    wear("lamp", opaque, Vec4f(1, 0.1f, 0.1f, 1), true);
    const Expected<ExportReport> report = exportScene(scratch.path("out.wrl"), built.take());
    ASSERT_TRUE(report);
    EXPECT_EQ(report->files.size(), 4u) << "three pictures: white, red, a veil";
    EXPECT_TRUE(report->notes.empty()) << report->notes.front();
    const ImportedAspect again = readBack(scratch.path("out.wrl"));
    const std::vector<std::uint8_t> red = {255, 70, 11, 255, 255, 70, 11, 255},
                                    white = {255, 204, 51, 255, 255, 204, 51, 255},
                                    veil = {255, 204, 51, 128, 255, 204, 51, 64};
    for (const auto& [name, pixels, opacity, unlit] : {std::tuple("red", red, 1.0f, false),
                                                       {"white", white, 1.0f, false},
                                                       {"glass", red, 0.5f, false},
                                                       {"veil", veil, 1.0f, false},
                                                       {"lamp", red, 1.0f, true}}) {
        const auto* geometry = again.core<Geometry>(std::string("/") + name);
        const auto* material = geometry ? again->get<Material>(geometry->material) : nullptr;
        ASSERT_NE(material, nullptr) << name;
        EXPECT_EQ(bytesOf(again->get<Image>(material->baseColorImage)), pixels) << name;
        EXPECT_TRUE(material->baseColor.isApprox(Vec4f(1, 1, 1, opacity), 1e-5f)) << name;
        EXPECT_EQ(material->unlit, unlit) << name;
    }
}

/// Grey pictures make a colour darker there; ours are of colours.
TEST(ExportedLooks, OfVrmlWithAGreyPictureAreTheSameAgain) {
    const Scratch scratch;
    const std::string path =
        scratch.write("grey.wrl",
                      "#VRML V2.0 utf8\nShape { appearance Appearance { material Material { diffuseColor 1 0 0 } "
                      "texture PixelTexture { image 2 1 1 0xFF 0x80 } } geometry Box {} }\n");
    ASSERT_TRUE(exportScene(scratch.path("out.wrl"), *readBack(path)));
    const ImportedAspect again = readBack(scratch.path("out.wrl"));
    std::vector<std::uint8_t> pixels;
    for (const ObjectId id : again->ids())
        if (const auto* image = again->get<Image>(id)) pixels = bytesOf(image);
    EXPECT_EQ(pixels, (std::vector<std::uint8_t>{255, 0, 0, 255, 128, 0, 0, 255}));
}

/// 1024 tints of a small picture beside the first, and the picture as it is for all others.
TEST(ExportedLooks, OfVrmlHaveNoTintsOfAPictureWithoutEnd) {
    const Scratch scratch;
    BuiltScene built;
    Image image;
    image.pixels = blobOf<std::uint8_t>({255, 255, 255, 255});
    image.widthPx = image.heightPx = 1;
    const ObjectId picture = built.add(image);
    Geometry geometry = triangleGeometry();
    geometry.texcoords = blobOf<float>({0, 0, 1, 0, 0, 1});
    for (int i = 0; i < 1027; ++i) {
        Material material;
        material.baseColor = Vec4f(5e-4f * static_cast<float>(i), 1, 1, 1);
        material.baseColorImage = picture;
        geometry.material = built.add(material);
        built.node("tint", built.add(geometry));
    }
    const Expected<ExportReport> report = exportScene(scratch.path("out.wrl"), built.take());
    ASSERT_TRUE(report);
    EXPECT_EQ(report->files.size(), 1u + 1024 + 1 + 1);
    ASSERT_EQ(report->notes.size(), 1u);
    EXPECT_EQ(report->notes.front(), "tints are left out of images that have too many: /tint[1025], /tint[1026]");
}

TEST(ExportedLooks, OfObjAreSolidWhereAMaskIs) {
    const Scratch scratch;
    Material leaf;
    leaf.baseColor[3] = 0.5f;
    leaf.alphaMode = Material::kMask;
    ASSERT_TRUE(exportScene(scratch.path("leaf.obj"), pictured(0, leaf)));
    EXPECT_NE(textOf(scratch.path("leaf.obj.mtl")).find("\nd 1\n"), std::string::npos);
    leaf.alphaMode = Material::kBlend;
    ASSERT_TRUE(exportScene(scratch.path("glass.obj"), pictured(0, leaf)));
    EXPECT_NE(textOf(scratch.path("glass.obj.mtl")).find("\nd 0.5\n"), std::string::npos);
}

TEST(ExportedMotion, OfVrmlHasItsRoutesBehindAllNodes) {
    const Scratch scratch;
    const ImportedAspect arm = readBack(std::string(TESSERA_SOURCE_DIR) + "/tests/data/models/arm.glb");
    ASSERT_TRUE(exportScene(scratch.path("arm.wrl"), *arm));
    const std::string text = textOf(scratch.path("arm.wrl"));
    const std::size_t first = text.find("\nROUTE ");
    ASSERT_NE(first, std::string::npos);
    EXPECT_EQ(text.find("DEF ", first), std::string::npos);
}

TEST(ExportedNotes, OfFormatsWithoutNodesNameWhatTheseWouldBear) {
    const Scratch scratch;
    BuiltScene built;
    built.node("lamp", built.add(PointLight()));
    built.node("triangle", built.add(triangleGeometry()));
    const Aspect scene = built.take();
    for (const char* out : {"out.obj", "out.stl", "out.ply"}) {
        const Expected<ExportReport> report = exportScene(scratch.path(out), scene);
        ASSERT_TRUE(report);
        EXPECT_TRUE(std::ranges::count(report->notes, "lights are left out: /lamp") == 1) << out;
    }
}

TEST(ExportedNotes, SayWhereVerticesHaveAnOpacityThatAFormatLacks) {
    const Scratch scratch;
    BuiltScene built;
    Geometry geometry = triangleGeometry();
    geometry.colors = blobOf<std::uint8_t>({255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255});
    built.node("solid", built.add(geometry));
    geometry.colors = blobOf<std::uint8_t>({255, 0, 0, 255, 0, 255, 0, 128, 0, 0, 255, 255});
    built.node("faint", built.add(geometry));
    const Aspect scene = built.take();
    for (const char* out : {"out.obj", "out.wrl", "out.usda", "out.ply", "out.glb"}) {
        const Expected<ExportReport> report = exportScene(scratch.path(out), scene);
        ASSERT_TRUE(report);
        const bool isKept = std::string_view(out) == "out.ply" || std::string_view(out) == "out.glb";
        EXPECT_EQ(std::ranges::count(report->notes, "opacities of vertices are left out: /faint"), isKept ? 0 : 1)
            << out;
    }
}

TEST(ExportedNames, OfObjAreThoseOfTheNodeAboveAnAutomaticOne) {
    const Scratch scratch;
    BuiltScene built;
    built.node("geometry", built.add(triangleGeometry()), built.node("hook"));
    ASSERT_TRUE(exportScene(scratch.path("crane.obj"), built.take()));
    EXPECT_NE(textOf(scratch.path("crane.obj")).find("\no hook\n"), std::string::npos);
}

}  // namespace
}  // namespace tessera
