/// MPCDI archives to walls: geometry, warp maps, alpha maps, and archives from somebody who means ill.
#include <gtest/gtest.h>
#include <minizip/zip.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "common/codec/WallCodec.h"
#include "common/output/BlendPicture.h"
#include "common/output/MeshLook.h"
#include "server/tools/mpcdi/MpcdiWall.h"
#include "server/tools/mpcdi/ZipFile.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

using Entries = std::vector<std::pair<std::string, std::string>>;

/// Where a projector's pixel (0 to 1 from its upper left) looks.
using WarpFunction = std::function<std::pair<double, double>(double x, double y)>;

std::string pfm(int width, int height, const WarpFunction& warp, bool bigEndian = false) {
    std::string text =
        "PF\n" + std::to_string(width) + " " + std::to_string(height) + "\n" + (bigEndian ? "1.0" : "-1.0") + "\n";
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto [u, v] = warp((x + 0.5) / width, (y + 0.5) / height);
            for (const float value : {static_cast<float>(u), static_cast<float>(v), 0.0f}) {
                char bytes[4];
                std::memcpy(bytes, &value, 4);
                if (bigEndian) std::swap(bytes[0], bytes[3]), std::swap(bytes[1], bytes[2]);
                text.append(bytes, 4);
            }
        }
    }
    return text;
}

std::pair<double, double> barrel(double x, double y) {
    const double cx = x - 0.5, cy = y - 0.5, r = cx * cx + cy * cy;
    return {0.5 + cx * (0.9 + 0.15 * r), 0.5 + cy * (0.92 + 0.1 * r) + 0.03 * cx};
}

constexpr const char* kFlatXml = R"(<?xml version="1.0" encoding="utf-8"?>
<MPCDI profile="2d" level="1" date="2026-01-01 10:00:00" version="1.0">
  <display><buffer id="wall" xResolution="300" yResolution="100">
    <region id="one" xResolution="200" yResolution="100" x="0" y="0" xsize="0.6" ysize="1"/>
    <region id="two &amp; more" xResolution="160" yResolution="90" x="0.4" y="0.25" xsize="0.6" ysize="0.5"/>
  </buffer></display>
  <files>
    <fileset region="one"><alphaMap><path>one.png</path><componentDepth>1</componentDepth><bitDepth>16</bitDepth>
    <gammaEmbedded>2.2</gammaEmbedded></alphaMap>
      <betaMap><path>one-b.png</path></betaMap>
      <geometryWarpFile><path>maps/one.pfm</path><interpolation>linear</interpolation></geometryWarpFile></fileset>
    <fileset region="two &amp; more"><geometryWarpFile><path>two.pfm</path><interpolation>linear</interpolation>
    </geometryWarpFile></fileset>
  </files>
</MPCDI>)";

class Mpcdi : public testing::Test {
protected:
    Mpcdi() {
        std::string pattern = testing::TempDir() + "tessera-test-XXXXXX";
        folder_ = ::mkdtemp(pattern.data());
        BlendPicture half{.widthPx = 4, .heightPx = 2, .values = std::vector<std::uint16_t>(8, 32768)};
        flat_ = {{"mpcdi.xml", kFlatXml},
                 {"maps/one.pfm", pfm(200, 100, barrel)},
                 {"two.pfm", pfm(
                                 31, 17, [](double x, double y) { return std::pair(x, y); }, true)},
                 {"one.png", std::string(asText(encodeBlendPicture(half)))}};
    }
    ~Mpcdi() override { fs::remove_all(folder_); }
    std::string zip(const Entries& entries) {
        const std::string path = (folder_ / "try.mpcdi").string();
        const zipFile out = zipOpen64(path.c_str(), APPEND_STATUS_CREATE);
        for (const auto& [name, content] : entries) {
            zip_fileinfo info{};
            zipOpenNewFileInZip64(out, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, 6, 1);
            zipWriteInFileInZip(out, content.data(), static_cast<unsigned>(content.size()));
            zipCloseFileInZip(out);
        }
        zipClose(out, nullptr);
        return path;
    }
    std::string errorOf(const Entries& entries) {
        const auto file = readMpcdi(zip(entries));
        if (!file) return file.error().message;
        const auto wall = wallOfMpcdi(*file);
        return wall ? "accepted" : wall.error().message;
    }
    /// The flat one with another text in its XML.
    std::string errorAfter(const std::string& from, const std::string& to) {
        Entries entries = flat_;
        std::string& xml = entries[0].second;
        EXPECT_NE(xml.find(from), std::string::npos) << from;
        xml.replace(xml.find(from), from.size(), to);
        return errorOf(entries);
    }
    fs::path folder_;
    Entries flat_;
};

TEST_F(Mpcdi, FlatRegionsBecomeScreensOfOnePlane) {
    const auto file = readMpcdi(zip(flat_));
    ASSERT_TRUE(file) << file.error().message;
    const auto made = wallOfMpcdi(*file);
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_EQ(made->wall.screens.size(), 2u);
    const Screen& one = made->wall.screens[0];
    const Screen& two = made->wall.screens[1];
    EXPECT_EQ(two.name, "two---more");
    EXPECT_EQ(one.grid.tileWidthPx, 180);
    EXPECT_EQ(two.grid.tileHeightPx, 50);
    EXPECT_NEAR(two.lowerLeft.x() - one.lowerLeft.x(), 0.4 * 3.2, 1e-9);
    EXPECT_NEAR(one.upperLeft.y() - two.upperLeft.y(), 0.25 * one.heightMetres(), 1e-9) << "y counts from the top";
    const TileOutput& out = made->wall.hosts[0].tiles[0].output;
    EXPECT_EQ(out.widthPx, 200);
    EXPECT_EQ(out.blendPictureGamma, 2.2);
    ASSERT_TRUE(out.blendPicture);
    for (const std::string& note : made->notes) EXPECT_WORDS(note);
}

TEST_F(Mpcdi, MeshesShowWhatWarpMapsSayToATenthOfAPixel) {
    for (unsigned seed = 0; seed < 12; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> some(-0.04, 0.04);
        const double a = some(random), b = some(random), c = some(random), d = some(random);
        const WarpFunction warp = [&](double x, double y) {
            return std::pair(x * 0.9 + 0.05 + a * std::sin(3 * y + x) + b * x * y,
                             y * 0.9 + 0.05 + c * std::cos(2 * x) + d * x * y * y);
        };
        Entries entries = flat_;
        entries[1].second = pfm(200, 100, warp, seed % 2 == 0);
        const auto made = wallOfMpcdi(readMpcdi(zip(entries)).value()).value();
        EXPECT_LE(made.farthestPx, 0.1) << "seed " << seed;
        // The whole way once more: what each pixel of the projector sees through the mesh, beside the function.
        double farthest = 0;
        lookThrough(*made.wall.hosts[0].tiles[0].output.warp, 200, 100, [&](int x, int y, const Look& look) {
            const auto [u, v] = warp((x + 0.5) / 200, (y + 0.5) / 100);
            farthest = std::max({farthest, 180 * std::abs(look.u - u), 100 * std::abs(look.v - v)});
        });
        EXPECT_LE(farthest, 0.11) << "seed " << seed;
    }
}

TEST_F(Mpcdi, FrustaBecomeScreensAroundTheViewer) {
    Entries entries = flat_;
    entries[0].second =
        R"(<MPCDI profile="3d" version="1.0"><display><buffer id="b">
        <region id="left" xResolution="100" yResolution="80" x="0" y="0" xsize="1" ysize="1">
      <frustum><yaw>-90</yaw><pitch>0</pitch><roll>0</roll><rightAngle>45</rightAngle><leftAngle>-45</leftAngle>
      <upAngle>26.565051177</upAngle><downAngle>-26.565051177</downAngle></frustum>
      </region></buffer></display><files><fileset region="left"><geometryWarpFile><path>maps/one.pfm</path>
      </geometryWarpFile></fileset></files></MPCDI>)";
    const auto file = readMpcdi(zip(entries));
    ASSERT_TRUE(file) << file.error().message;
    const auto made = wallOfMpcdi(*file);
    ASSERT_TRUE(made) << made.error().message;
    const Screen& screen = made->wall.screens[0];
    // Looking left: the screen stands at x = -2; its left end is behind (+z), its right end in front.
    EXPECT_LT((screen.lowerLeft - Vec3d(-2, 0.7, 2)).norm(), 1e-6) << screen.lowerLeft.transpose();
    EXPECT_LT((screen.lowerRight - Vec3d(-2, 0.7, -2)).norm(), 1e-6) << screen.lowerRight.transpose();
    EXPECT_LT((screen.upperLeft - Vec3d(-2, 2.7, 2)).norm(), 1e-6) << screen.upperLeft.transpose();
}

/// Where a projector's pixel (0 to 1 from its upper left) hits, in metres.
using Surface = std::function<Vec3d(double x, double y)>;

std::string surfacePfm(int width, int height, const Surface& surface, double unitsPerMetre) {
    std::string text = "PF\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Vec3d place = unitsPerMetre * surface((x + 0.5) / width, (y + 0.5) / height);
            for (int axis = 0; axis < 3; ++axis) {
                const auto value = static_cast<float>(place[axis]);
                text.append(reinterpret_cast<const char*>(&value), 4);
            }
        }
    }
    return text;
}

Entries surfaceFile(const std::vector<std::pair<std::string, Surface>>& regions, const std::string& unit,
                    double unitsPerMetre, const std::string& origin, const std::string& frame = {}) {
    std::string display, files;
    Entries entries{{"mpcdi.xml", ""}};
    for (const auto& [id, surface] : regions) {
        display += "<region id=\"" + id +
                   "\" xResolution=\"960\" yResolution=\"540\" x=\"0\" y=\"0\" xsize=\"1\" ysize=\"1\">" + frame +
                   "</region>";
        files += "<fileset region=\"" + id + "\"><geometryWarpFile><path>" + id + ".pfm</path><geometricUnit>" + unit +
                 "</geometricUnit><originof3DData>" + origin + "</originof3DData></geometryWarpFile></fileset>";
        entries.emplace_back(id + ".pfm", surfacePfm(96, 54, surface, unitsPerMetre));
    }
    entries[0].second = "<MPCDI profile=\"a3\" version=\"2.0\"><display><buffer id=\"b\">" + display +
                        "</buffer></display><files>" + files + "</files></MPCDI>";
    return entries;
}

TEST_F(Mpcdi, FlatSurfacesInSpaceAreScreensWhereTheyStand) {
    std::vector<std::pair<std::string, Surface>> regions;
    for (const auto& [id, left, bottom] : {std::tuple("lower-left", -1.6, 0.6),
                                           {"lower-right", 0.0, 0.6},
                                           {"upper-left", -1.6, 1.5},
                                           {"upper-right", 0.0, 1.5}})
        regions.emplace_back(id, [left = left, bottom = bottom](double x, double y) {
            return Vec3d(left + 1.6 * x, bottom + 0.9 * (1 - y), -2.4);
        });
    // A wall to the right, from front to back.
    regions.emplace_back("right", [](double x, double y) { return Vec3d(1.2, 2.4 * (1 - y), -1 + 2 * x); });
    const auto made = wallOfMpcdi(readMpcdi(zip(surfaceFile(regions, "cm", 100, "floorCenter"))).value());
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_EQ(made->wall.screens.size(), 5u);
    for (int i = 0; i < 4; ++i) {
        const Screen& screen = made->wall.screens[static_cast<std::size_t>(i)];
        const Vec3d corner(i % 2 == 0 ? -1.6 : 0, i < 2 ? 0.6 : 1.5, -2.4);
        EXPECT_LT((screen.lowerLeft - corner).norm(), 2e-6) << screen.name << screen.lowerLeft.transpose();
        EXPECT_LT((screen.lowerRight - corner - Vec3d(1.6, 0, 0)).norm(), 2e-6) << screen.lowerRight.transpose();
        EXPECT_LT((screen.upperLeft - corner - Vec3d(0, 0.9, 0)).norm(), 2e-6) << screen.upperLeft.transpose();
        EXPECT_EQ(screen.grid.tileWidthPx, 960);
        EXPECT_EQ(screen.grid.tileHeightPx, 540);
    }
    const Screen& right = made->wall.screens[4];
    EXPECT_LT((right.lowerLeft - Vec3d(1.2, 0, -1)).norm(), 2e-6) << right.lowerLeft.transpose();
    EXPECT_LT((right.lowerRight - Vec3d(1.2, 0, 1)).norm(), 2e-6) << right.lowerRight.transpose();
    EXPECT_EQ(made->wall.users[0].position, Vec3d(0, 1.7, 0));
    EXPECT_LE(made->farthestPx, 0.01) << "nothing is bent";

    // The same in the axes of a surveyor, Z up, Y ahead, and counted from the eyes.
    const std::string surveyor =
        "<coordinateFrame><posx>0</posx><posy>0</posy><posz>0</posz><yawx>0</yawx><yawy>0</yawy><yawz>-1</"
        "yawz><pitchx>1</pitchx><pitchy>0</pitchy><pitchz>0</pitchz><rollx>0</rollx><rolly>1</rolly><rollz>0</rollz></"
        "coordinateFrame>";
    const auto other = wallOfMpcdi(
        readMpcdi(
            zip(surfaceFile(
                {{"one", [](double x, double y) { return Vec3d(-1.6 + 1.6 * x, 2.4, 0.6 - 1.7 + 0.9 * (1 - y)); }}},
                "m", 1, "idealEyePoint", surveyor)))
            .value());
    ASSERT_TRUE(other) << other.error().message;
    EXPECT_LT((other->wall.screens[0].lowerLeft - Vec3d(-1.6, 0.6, -2.4)).norm(), 2e-6)
        << other->wall.screens[0].lowerLeft.transpose();
}

TEST_F(Mpcdi, BentSurfacesInSpaceAreRightFromTheEyes) {
    // A part of a cylinder of 3 m about the eyes.
    const Surface bent = [](double x, double y) {
        return Vec3d(3 * std::sin(1.2 * (x - 0.5)), 0.7 + 2 * (1 - y), -3 * std::cos(1.2 * (x - 0.5)));
    };
    const auto made = wallOfMpcdi(readMpcdi(zip(surfaceFile({{"one", bent}}, "mm", 1000, "floorCenter"))).value());
    ASSERT_TRUE(made) << made.error().message;
    for (const std::string& note : made->notes) EXPECT_WORDS(note);
    const Screen& screen = made->wall.screens[0];
    const Vec3d eyes(0, 1.7, 0);
    double farthest = 0;
    lookThrough(*made->wall.hosts[0].tiles[0].output.warp, 960, 540, [&](int x, int y, const Look& look) {
        const Vec3d seen = screen.lowerLeft + look.u * (screen.lowerRight - screen.lowerLeft) +
                           (1 - look.v) * (screen.upperLeft - screen.lowerLeft);
        const Vec3d hit = bent((x + 0.5) / 960, (y + 0.5) / 540);
        farthest =
            std::max(farthest, std::acos(std::min(1.0, (seen - eyes).normalized().dot((hit - eyes).normalized()))));
    });
    // A pixel is 1.2 / 960 of a radian.
    EXPECT_LT(farthest, 0.5 * 1.2 / 960) << farthest;
    const Surface around = [](double x, double y) {
        return Vec3d(3 * std::sin(4 * (x - 0.5)), 0.7 + 2 * (1 - y), -3 * std::cos(4 * (x - 0.5)));
    };
    EXPECT_WORDS(errorOf(surfaceFile({{"one", around}}, "m", 1, "floorCenter")));
    EXPECT_WORDS(
        errorOf(surfaceFile({{"one", [](double x, double y) { return x < 0.5 ? Vec3d(0, 0, 0) : Vec3d(x, y, -2); }}},
                            "m", 1, "floorCenter")));
    EXPECT_WORDS(
        errorOf(surfaceFile({{"one", [](double, double) { return Vec3d(1, 1, -2); }}}, "m", 1, "floorCenter")));
}

/// As calibrations of projectors write it: the XML alone, axes of a surveyor.
constexpr const char* kLampXml = R"(<?xml version="1.0" encoding="utf-8"?>
<MPCDI profile="sl" geometry="2" color="1" date="2026-01-01 10:00:00" version="2.0"><display><buffer id="hall.cal">
  <region id="lamp 1" xResolution="1400" yResolution="1050" x="0" y="0" xsize="1" ysize="1">
    <frustum><yaw>90</yaw><pitch>0</pitch><roll>0</roll><rightAngle>45</rightAngle><leftAngle>-45</leftAngle>
      <upAngle>26.56505117707799</upAngle><downAngle>0</downAngle></frustum>
    <coordinateFrame><posx>0.5</posx><posy>-1</posy><posz>0.3</posz><yawx>0</yawx><yawy>0</yawy><yawz>-1</yawz>
      <pitchx>1</pitchx><pitchy>0</pitchy><pitchz>0</pitchz><rollx>0</rollx><rolly>1</rolly><rollz>0</rollz>
      </coordinateFrame>
  </region></buffer></display>
  <files><fileset region="lamp 1"><geometryWarpFile><geometricUnit>m</geometricUnit>
    <originOf3DData>unknown</originOf3DData><path></path></geometryWarpFile><alphaMap><path></path></alphaMap>
    <distortionMap><path></path></distortionMap></fileset></files>
</MPCDI>)";

TEST_F(Mpcdi, ShaderLampsSeeWithTheirProjectorsEyes) {
    const std::string path = (folder_ / "hall.mpcdi.xml").string();
    std::ofstream(path) << kLampXml;
    const auto made = wallOfMpcdiFile(path);
    ASSERT_TRUE(made) << made.error().message;
    const User& eyes = made->wall.users[0];
    // Half a metre to the right, 0.3 up, and one back.
    EXPECT_LT((eyes.position - Vec3d(0.5, 0.3, 1)).norm(), 1e-12);
    EXPECT_EQ(eyes.eyeSeparationMetres, 0);
    // It looks to the right: its picture stands 2 m away, its left end ahead.
    const Screen& screen = made->wall.screens[0];
    EXPECT_LT((screen.lowerLeft - Vec3d(2.5, 0.3, -1)).norm(), 1e-9) << screen.lowerLeft.transpose();
    EXPECT_LT((screen.lowerRight - Vec3d(2.5, 0.3, 3)).norm(), 1e-9) << screen.lowerRight.transpose();
    EXPECT_LT((screen.upperLeft - Vec3d(2.5, 1.3, -1)).norm(), 1e-9) << screen.upperLeft.transpose();
    EXPECT_EQ(screen.grid.tileWidthPx, 1400);
    EXPECT_FALSE(made->wall.hosts[0].tiles[0].output.warp);
    ASSERT_TRUE(saveForeignWall(*made, (folder_ / "lamps.wall").string()));
    EXPECT_TRUE(loadWall((folder_ / "lamps.wall").string()));

    const auto wrong = [&](const std::string& from, const std::string& to) {
        std::string xml = kLampXml;
        xml.replace(xml.find(from), from.size(), to);
        std::ofstream(path) << xml;
        const auto file = wallOfMpcdiFile(path);
        return file ? std::string("accepted") : file.error().message;
    };
    EXPECT_WORDS(wrong("<posx>0.5", "<posx>far"));
    EXPECT_WORDS(wrong("<pitchx>1", "<pitchx>2"));
    EXPECT_WORDS(wrong("<distortionMap><path>", "<distortionMap><path>lens.pfm"));
    // A lens: the same mesh that a warp map makes.
    Entries entries = flat_;
    std::string xml = kLampXml;
    xml.replace(xml.find("<distortionMap><path>"), 21, "<distortionMap><path>maps/one.pfm");
    entries[0].second = xml;
    const auto bent = wallOfMpcdi(readMpcdi(zip(entries)).value());
    ASSERT_TRUE(bent) << bent.error().message;
    EXPECT_TRUE(bent->wall.hosts[0].tiles[0].output.warp);
}

TEST_F(Mpcdi, WallsThatAreSavedCanBeLoaded) {
    const auto made = wallOfMpcdi(readMpcdi(zip(flat_)).value()).value();
    const std::string path = (folder_ / "hall.wall").string();
    ASSERT_TRUE(saveForeignWall(made, path));
    const auto loaded = loadWall(path);
    ASSERT_TRUE(loaded) << loaded.error().message;
    const TileOutput& out = loaded->hosts[0].tiles[0].output;
    EXPECT_EQ(out.warpFile, "hall-one.warp");
    EXPECT_EQ(*out.blendPicture, *made.wall.hosts[0].tiles[0].output.blendPicture);
    const WarpMesh& before = *made.wall.hosts[0].tiles[0].output.warp;
    ASSERT_EQ(out.warp->nodes.size(), before.nodes.size());
    for (std::size_t i = 0; i < before.nodes.size(); ++i) {
        EXPECT_NEAR(out.warp->nodes[i].x, before.nodes[i].x, 1e-6);
        EXPECT_EQ(out.warp->nodes[i].v, before.nodes[i].v);
    }
}

TEST_F(Mpcdi, WhatIsWrongIsSaid) {
    EXPECT_EQ(errorOf(flat_), "accepted");
    EXPECT_WORDS(errorAfter("profile=\"2d\"", "profile=\"a4\""));
    EXPECT_WORDS(errorAfter("profile=\"2d\"", "profile=\"sl\""));
    EXPECT_WORDS(errorAfter("profile=\"2d\"", "profile=\"3d\""));
    EXPECT_WORDS(errorAfter("</MPCDI>", ""));
    EXPECT_WORDS(errorAfter("<display>", "<dismay>"));
    EXPECT_WORDS(errorAfter("xResolution=\"200\"", "xResolution=\"1e9\""));
    EXPECT_WORDS(errorAfter("xsize=\"0.6\"", "xsize=\"nan\""));
    // What it says ends up in a wall's file: a line of its own must not.
    EXPECT_WORDS(errorAfter("region id=\"one\"", "region id=\"one&#10;hosts { }\""));
    EXPECT_WORDS(errorAfter("maps/one.pfm", "maps/none.pfm"));
    EXPECT_WORDS(errorAfter("maps/one.pfm", "one.png"));
    EXPECT_WORDS(errorAfter("one.png", "two.pfm"));
    EXPECT_WORDS(errorAfter("fileset region=\"one\"", "fileset region=\"three\""));
    EXPECT_WORDS(errorAfter("id=\"two &amp; more\"", "id=\"one\""));
    Entries entries = flat_;
    entries[1].second = pfm(
        20, 10, [](double x, double y) { return x > 0.5 && y > 0.5 ? std::pair(std::nan(""), 0.0) : std::pair(x, y); });
    EXPECT_WORDS(errorOf(entries));
    entries[1].second = pfm(20, 10, [](double x, double y) { return std::pair(x < 0.5 ? 2 * x : 2 - 2 * x, y); });
    EXPECT_WORDS(errorOf(entries));
    entries[1].second = pfm(20, 10, barrel).substr(0, 900);
    EXPECT_WORDS(errorOf(entries));
}

TEST_F(Mpcdi, ArchivesThatMeanIllAreRefused) {
    EXPECT_WORDS(readMpcdi("/nonexistent.mpcdi").error().message);
    EXPECT_WORDS(readMpcdi("/dev/null").error().message);
    for (const char* name : {"../mpcdi.xml", "a/../../x", "/etc/passwd", "a\\..\\x", "c:x"})
        EXPECT_WORDS(errorOf({{name, "x"}, {"mpcdi.xml", "x"}}));
    EXPECT_WORDS(errorOf({{"mpcdi.xml", "x"}, {"mpcdi.xml", "y"}}));
    EXPECT_WORDS(errorOf({{"mpcdi.xml", std::string(5 << 20, ' ')}}));
    Entries many;
    for (int i = 0; i < 4100; ++i) many.emplace_back("f" + std::to_string(i), "");
    EXPECT_WORDS(errorOf(many));
    // A billion laughs: entities of one's own are not known, so nothing grows.
    EXPECT_NE(
        errorOf({{"mpcdi.xml",
                  "<!DOCTYPE x [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]><MPCDI profile=\"&b;\"/>"}}),
        "accepted");
    std::string deep;
    for (int i = 0; i < 200'000; ++i) deep += "<a>";
    EXPECT_WORDS(errorOf({{"mpcdi.xml", deep}}));
    // Sizes in the directory that lie: what is unpacked counts.
    std::ifstream in(zip(flat_), std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), {});
    std::mt19937 random(17);
    for (int i = 0; i < 1500; ++i) {
        std::string damaged = whole;
        for (int k = 0; k < 4; ++k)
            damaged[random() % 2 == 0 ? random() % damaged.size() : damaged.size() - 1 - random() % 400] =
                static_cast<char>(random());
        if (random() % 4 == 0) damaged.resize(random() % damaged.size());
        const std::string path = (folder_ / "damaged.mpcdi").string();
        std::ofstream(path, std::ios::binary) << damaged;
        const auto file = readMpcdi(path);
        if (!file) {
            EXPECT_FALSE(file.error().message.empty());
        }
    }
}

}  // namespace
}  // namespace tessera
