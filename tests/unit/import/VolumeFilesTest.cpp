// Scalar fields in files: real ones, every number format, and files that lie; volumes and particles that authors write.
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <random>

#include "common/cores/Material.h"
#include "common/cores/Particles.h"
#include "common/cores/Volume.h"
#include "common/drawable/Drawable.h"
#include "server/import/reader/VolumeFiles.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<VolumeData> volumeIn(const Scratch& scratch, const std::string& name) {
    return readVolumeFile(FolderFiles(std::filesystem::path(scratch.path("x")).parent_path().string(), 1 << 20), name);
}

template <typename Number>
std::string packedNumbers(std::initializer_list<double> numbers, bool bigEndian = false) {
    std::string bytes;
    for (const double number : numbers) {
        const auto value = static_cast<Number>(number);
        std::string each(sizeof value, '\0');
        std::memcpy(each.data(), &value, sizeof value);
        if (bigEndian) std::reverse(each.begin(), each.end());
        bytes += each;
    }
    return bytes;
}

std::string metaHeader(const std::string& type, const std::string& more, const std::string& size = "2 2 2") {
    return fmt::format("ObjectType = Image\nNDims = 3\nDimSize = {}\nElementType = {}\n{}\nElementDataFile = LOCAL\n",
                       size, type, more);
}

void expectEight(const Expected<VolumeData>& volume, VoxelFormat format, const std::array<double, 8>& numbers) {
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->format, format);
    const VoxelGrid grid = volume->grid();
    ASSERT_EQ(grid.size, (std::array<std::size_t, 3>{2, 2, 2}));
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(grid.at(i & 1, i >> 1 & 1, i >> 2 & 1), numbers[i]) << i;
}

TEST(VolumeFiles, HoldEveryFormatOfNumbers) {
    const Scratch scratch;
    const std::array<double, 8> small{0, 1, 2, 3, 100, 101, 127, 5}, with{-3, 1, 2, 3, 100, -101, 127, 5},
        large{-70000, 1, 2, 3, 100, 3.5e6, 127, 5};
    const auto mha = [&](const std::string& type, const std::string& more, const std::string& bytes) {
        scratch.write("a.mha", metaHeader(type, more) + bytes);
        return volumeIn(scratch, "a.mha");
    };
    expectEight(mha("MET_UCHAR", "", packedNumbers<std::uint8_t>({0, 1, 2, 3, 100, 101, 127, 5})), VoxelFormat::kUint8,
                small);
    expectEight(mha("MET_USHORT", "", packedNumbers<std::uint16_t>({0, 1, 2, 3, 100, 101, 127, 5})),
                VoxelFormat::kUint16, small);
    expectEight(mha("MET_SHORT", "ElementByteOrderMSB = True",
                    packedNumbers<std::int16_t>({-3, 1, 2, 3, 100, -101, 127, 5}, true)),
                VoxelFormat::kInt16, with);
    expectEight(mha("MET_CHAR", "", packedNumbers<std::int8_t>({-3, 1, 2, 3, 100, -101, 127, 5})), VoxelFormat::kFloat,
                with);
    expectEight(mha("MET_INT", "BinaryDataByteOrderMSB = True",
                    packedNumbers<std::int32_t>({-70000, 1, 2, 3, 100, 3.5e6, 127, 5}, true)),
                VoxelFormat::kFloat, large);
    expectEight(mha("MET_FLOAT", "HeaderSize = 3", "xyz" + packedNumbers<float>({-70000, 1, 2, 3, 100, 3.5e6, 127, 5})),
                VoxelFormat::kFloat, large);
    expectEight(mha("MET_DOUBLE", "HeaderSize = -1",
                    "any thing" + packedNumbers<double>({-70000, 1, 2, 3, 100, 3.5e6, 127, 5})),
                VoxelFormat::kFloat, large);
    const std::string vtk =
        "# vtk DataFile Version 3.0\ntitle\n{}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nSPACING 1 2 3\nORIGIN 4 5 "
        "6\nPOINT_DATA 8\nSCALARS s {}\nLOOKUP_TABLE default\n";
    scratch.write("a.vtk", fmt::format(fmt::runtime(vtk), "BINARY", "short 1") +
                               packedNumbers<std::int16_t>({-3, 1, 2, 3, 100, -101, 127, 5}, true));
    const Expected<VolumeData> placed = volumeIn(scratch, "a.vtk");
    expectEight(placed, VoxelFormat::kInt16, with);
    EXPECT_EQ(placed->spacing, Vec3d(1, 2, 3));
    EXPECT_EQ(placed->origin, Vec3d(4, 5, 6));
    scratch.write("a.vtk", fmt::format(fmt::runtime(vtk), "ASCII", "float") + "-3 1 2 3\n100 -101 1.27e2 5");
    expectEight(volumeIn(scratch, "a.vtk"), VoxelFormat::kFloat, with);
    scratch.write(
        "a.nrrd",
        "NRRD0004\n# made by hand\ntype: short\ndimension: 3\nsizes: 2 2 2\nendian: little\nencoding: raw\n\n" +
            packedNumbers<std::int16_t>({-3, 1, 2, 3, 100, -101, 127, 5}));
    expectEight(volumeIn(scratch, "a.nrrd"), VoxelFormat::kInt16, with);
    // Runs: 3 of 7, then one by itself; the second slice one by one.
    scratch.write("a.slc", std::string("11111\n2 2 2 8\n1 1 1\n0 0 0 1\n1 1 Xrgb5 X\x03\x07\x81\x09") + '\0' +
                               "6 X\x84"
                               "abcd" +
                               '\0');
    expectEight(volumeIn(scratch, "a.slc"), VoxelFormat::kUint8, {7, 7, 7, 9, 'a', 'b', 'c', 'd'});
}

TEST(VolumeFiles, ThatLieAreRefusedInWords) {
    const Scratch scratch, outside;
    const std::string eight(8, 'x'), vtk = "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET ";
    scratch.write("short.raw", "1234");
    outside.write("other.raw", eight);
    const auto expectRefused = [&](const std::string& name, const std::string& bytes, ErrorCode code) {
        scratch.write(name, bytes);
        const Expected<VolumeData> volume = volumeIn(scratch, name);
        ASSERT_FALSE(volume) << bytes;
        EXPECT_EQ(volume.error().code, code) << volume.error().message;
        EXPECT_WORDS(volume.error().message);
    };
    const auto meta = [&](const std::string& more, ErrorCode code = ErrorCode::kBadInput) {
        expectRefused("a.mhd", more + eight, code);
    };
    meta("NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n");
    meta(metaHeader("MET_UCHAR", "", "3 2 2"));
    meta(metaHeader("MET_UCHAR", "", "2 2"));
    meta(metaHeader("MET_UCHAR", "", "-2 2 2"));
    meta(metaHeader("MET_UCHAR", "", "1 2 2"));
    meta(metaHeader("MET_UCHAR", "", "99999999999 99999999999 99999999999"));
    meta(metaHeader("MET_UCHAR", "", "4096 4096 4096"), ErrorCode::kLimit);
    meta(metaHeader("MET_UCHAR", "ElementSpacing = 0 1 1"));
    meta(metaHeader("MET_UCHAR", "ElementSpacing = nan 1 1"));
    meta(metaHeader("MET_UCHAR", "CompressedData = True"), ErrorCode::kUnsupported);
    meta(metaHeader("MET_UCHAR", "BinaryData = False"), ErrorCode::kUnsupported);
    meta(metaHeader("MET_UCHAR", "ElementNumberOfChannels = 3"), ErrorCode::kUnsupported);
    meta(metaHeader("MET_UCHAR", "HeaderSize = 9"));
    meta(metaHeader("MET_CHARS", ""), ErrorCode::kUnsupported);
    const std::string beside = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = ";
    expectRefused("a.mhd", beside + "short.raw\n", ErrorCode::kBadInput);
    expectRefused("a.mhd", beside + "none.raw\n", ErrorCode::kNotFound);
    expectRefused("a.mhd", beside + outside.path("other.raw") + "\n", ErrorCode::kRefused);
    expectRefused(
        "a.mhd",
        beside + "../" + std::filesystem::path(outside.path("x")).parent_path().filename().string() + "/other.raw\n",
        ErrorCode::kRefused);
    expectRefused("a.mhd", beside + "LIST\n", ErrorCode::kUnsupported);
    expectRefused("a.vtk", "vtk", ErrorCode::kBadInput);
    expectRefused("a.vtk", vtk + "POLYDATA\nPOINTS 0 float\n", ErrorCode::kUnsupported);
    expectRefused("a.vtk", vtk + "STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nPOINT_DATA 9\n", ErrorCode::kBadInput);
    expectRefused("a.vtk", vtk + "STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nPOINT_DATA 8\nSCALARS s float 3\n",
                  ErrorCode::kUnsupported);
    expectRefused("a.vtk", vtk + "STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nPOINT_DATA 8\n", ErrorCode::kBadInput);
    expectRefused("a.slc", "11112\n", ErrorCode::kBadInput);
    expectRefused("a.slc", "11111\n2 2 2 16\n1 1 1\n0 0 0 0\n0 0 X", ErrorCode::kUnsupported);
    expectRefused("a.slc", "11111\n2 2 2 8\n1 1 1\n0 0 0 0\n70 70 X" + eight, ErrorCode::kBadInput);
    expectRefused("a.slc", "11111\n2 2 2 8\n1 1 1\n0 0 0 1\n0 0 X9999 X" + eight, ErrorCode::kBadInput);
    expectRefused("a.slc", std::string("11111\n2 2 2 8\n1 1 1\n0 0 0 1\n0 0 X3 X\x05\x07") + '\0',
                  ErrorCode::kBadInput);
    expectRefused("a.nrrd", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: gzip\n\n" + eight,
                  ErrorCode::kUnsupported);
}

// Damaged here or there: an error or a volume as large as it says, never a crash.
TEST(VolumeFiles, ThatAreDamagedAnywhereEndInWords) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned first = given ? static_cast<unsigned>(std::atoi(given)) : 1, last = given ? first : 8;
    const std::string numbers(27, 'n');
    const std::pair<const char*, std::string> whole[] = {
        {"a.mha", metaHeader("MET_UCHAR", "ElementSpacing = 1 2 3", "3 3 3") + numbers},
        {"a.vtk",
         "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 3 3\nSPACING 1 1 "
         "1\nPOINT_DATA 27\nSCALARS s char\nLOOKUP_TABLE default\n" +
             numbers},
        {"a.slc", std::string("11111\n3 3 2 8\n1 1 1\n0 0 0 1\n1 1 Xrgb3 X\x09\x07") + '\0' + "3 X\x09\x08" + '\0'},
        {"a.nrrd", "NRRD0004\ntype: double\ndimension: 3\nsizes: 2 2 2\nencoding: text\n\n1 2 3 4 5 6 7 8"}};
    for (unsigned seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(
            fmt::format("TESSERA_SEED={} build/bin/unit_import --gtest_filter=VolumeFiles.ThatAreDamaged*", seed));
        std::mt19937 random(seed);
        const Scratch scratch;
        int read = 0;
        for (int i = 0; i < 200; ++i) {
            const auto& [name, bytes] = whole[random() % 4];
            std::string damaged = bytes;
            for (std::size_t times = 1 + random() % 3; times > 0; --times) {
                const std::size_t at = random() % damaged.size();
                if (random() % 4 == 0)
                    damaged.resize(at + 1);
                else
                    damaged[at] =
                        random() % 2 == 0 ? static_cast<char>(random() % 256) : "0123456789 \n-X"[random() % 14];
            }
            scratch.write(name, damaged);
            const Expected<VolumeData> volume = volumeIn(scratch, name);
            if (!volume) {
                EXPECT_FALSE(volume.error().message.empty());
                continue;
            }
            ++read;
            ASSERT_EQ(volume->voxels.size(), volume->grid().count() * bytesOf(volume->format));
        }
        EXPECT_GT(read, 5);
    }
}

TEST(VolumeFiles, OfTheWorldAreReadWithASurface) {
    if (testData().empty()) GTEST_SKIP() << "the data are missing (TESSERA_TEST_DATA)";
    struct Known {
        const char* name;
        std::int64_t x, y, z;
        double spacing;
    };
    for (const Known& known : {Known{"HeadMRVolume.mhd", 48, 62, 42, 4}, Known{"bolt.slc", 70, 123, 66, 1},
                               Known{"neghip.slc", 66, 66, 66, 1}, Known{"ironProt.vtk", 68, 68, 68, 1}}) {
        SCOPED_TRACE(known.name);
        Expected<ImportedScene> scene = importScene(testData() + "/volume/" + known.name, kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_TRUE(scene->notes.empty()) << scene->notes[0];
        const ImportedAspect aspect(std::move(*scene));
        const Volume* volume = nullptr;
        for (const ObjectId id : aspect->ids())
            if (const auto* found = aspect->get<Volume>(id)) volume = found;
        ASSERT_NE(volume, nullptr);
        EXPECT_EQ(volume->sizeX, known.x);
        EXPECT_EQ(volume->sizeY, known.y);
        EXPECT_EQ(volume->sizeZ, known.z);
        EXPECT_EQ(volume->spacing, Vec3d::Constant(known.spacing));
        EXPECT_EQ(volume->format, Volume::kUint8);
        EXPECT_GT(volume->surfaceValue, volume->low);
        EXPECT_LT(volume->surfaceValue, volume->high);
        EXPECT_EQ(volume->mode, Volume::kSurface);
        EXPECT_GT(drawableOf(Object::of(*volume)).triangleCount(), 10'000u);
    }
}

Expected<ImportedScene> importedContent(const Scratch& scratch, const std::string& content) {
    return importScene(scratch.write("a.tsct", "material { name: \"red\" }\nnode { name: \"n\" material: \"red\"\n  " +
                                                   content + " }\n"),
                       kRootNode, importOptions());
}

TEST(VolumeText, SaysAllThatTheCoreHolds) {
    const Scratch scratch;
    scratch.write("in/field.mha", metaHeader("MET_UCHAR", "ElementSpacing = 1 2 3") +
                                      std::string("\x00\x01\x02\x03\x04\x05\x06\x64", 8));
    Expected<ImportedScene> scene = importedContent(scratch,
                                                    "volume { file: \"in/field.mha\" transfer: [0xFF000000, "
                                                    "0x00FF00FF] high: 50 mode: SLICES slices: [0,0,1,2, 1,0,0,0.5] "
                                                    "clip_planes: [0,1,0,1] step: 0.25 shaded: false thickness: 3 }");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* volume = aspect.core<Volume>("/n");
    ASSERT_NE(volume, nullptr);
    EXPECT_EQ(volume->voxels.sizeBytes(), 8u);
    EXPECT_EQ(volume->spacing, Vec3d(1, 2, 3));
    EXPECT_EQ(volume->low, 0);
    EXPECT_EQ(volume->high, 50);
    EXPECT_EQ(volume->mode, Volume::kSlices);
    EXPECT_EQ(volume->slices.as<double>()[7], 0.5);
    EXPECT_EQ(volume->clipPlanes.as<double>()[1], 1);
    EXPECT_EQ(volume->transfer.as<std::uint8_t>()[0], 255);
    EXPECT_EQ(volume->step, 0.25);
    EXPECT_FALSE(volume->shaded);
    EXPECT_EQ(volume->thickness, 3);
    EXPECT_TRUE(aspect->get<Material>(volume->material));
    // What a header names stands beside it.
    scratch.write("in/two.mhd", "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = two.raw\n");
    scratch.write("in/two.raw", "12345678");
    const Expected<ImportedScene> beside = importedContent(scratch, "volume { file: \"in/two.mhd\" }");
    EXPECT_TRUE(beside) << messageOf(beside);
    EXPECT_TRUE(importedContent(
        scratch, "volume { voxels: [0,0,0,0,1,1,1,1] size_x: 2 size_y: 2 size_z: 2 surface_value: 0.5 high: 1 }"));
}

TEST(ParticlesText, SaysAllThatTheCoreHolds) {
    const Scratch scratch;
    Expected<ImportedScene> scene =
        importedContent(scratch,
                        "particles { mode: QUADS positions: [0,0,0, 1,2,3] colors: [0x11223344, 0xFFFFFFFF] sizes: [1, "
                        "2] ages: [0, 0.5] turns: [0, 1] "
                        "age_colors: [0xFF0000FF] age_sizes: [1, 3] size: 4 sorted: false }");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* particles = aspect.core<Particles>("/n");
    ASSERT_NE(particles, nullptr);
    EXPECT_EQ(particles->mode, Particles::kQuads);
    EXPECT_EQ(particles->positions.as<float>()[5], 3);
    EXPECT_EQ(particles->colors.as<std::uint8_t>()[3], 0x44);
    EXPECT_EQ(particles->sizes.as<float>()[1], 2);
    EXPECT_EQ(particles->ages.as<float>()[1], 0.5F);
    EXPECT_EQ(particles->turns.as<float>()[1], 1);
    EXPECT_EQ(particles->ageColors.as<std::uint8_t>()[0], 255);
    EXPECT_EQ(particles->ageSizes.as<float>()[1], 3);
    EXPECT_EQ(particles->size, 4);
    EXPECT_FALSE(particles->sorted);
    EXPECT_TRUE(aspect->get<Material>(particles->material));
}

TEST(ParticlesText, AndVolumesAreRefusedWithFileLineAndColumn) {
    const Scratch scratch;
    scratch.write("bad.mha", metaHeader("MET_UCHAR", "", "9 9 9"));
    for (const char* const content : {
             "particles { positions: [0,0,0] sizes: [1,2] }",
             "particles { positions: [0,0,0] mode: LINES }",
             "particles { positions: [0,0,nan] }",
             "particles { positions: [0,0,0] size: -1 }",
             "particles { positions: [0,0,0] material: \"blue\" }",
             "volume { file: \"none.mhd\" }",
             "volume { file: \"bad.mha\" }",
             "volume { file: \"/etc/passwd\" }",
             "volume { file: \"a.tsct\" }",
             "volume { file: \"bad.mha\" voxels: [1] }",
             "volume { voxels: [1,2,3] size_x: 2 size_y: 2 size_z: 2 }",
             "volume { voxels: [1,2] size_x: 2 size_y: 1 size_z: 1 }",
             "volume { voxels: [1,2,3,4,5,6,7,inf] size_x: 2 size_y: 2 size_z: 2 }",
             "volume { low: 5 high: 5 }",
             "volume { slices: [0,0,0,1] }",
             "volume { clip_planes: [1,2,3] }",
             "volume { spacing { x: 1 y: 0 z: 1 } }",
         }) {
        const Expected<ImportedScene> scene = importedContent(scratch, content);
        ASSERT_FALSE(scene) << content;
        EXPECT_WORDS(scene.error().message);
    }
}

}  // namespace
}  // namespace tessera
