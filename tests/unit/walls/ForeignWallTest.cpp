/// Walls of SGCT, ParaView, nDisplay and OpenCOVER: where their screens and eyes are, what is not carried over, what is
/// refused.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>

#include "common/codec/WallCodec.h"
#include "server/tools/WallFormats.h"
#include "server/tools/walls/CoverWall.h"
#include "server/tools/walls/NdisplayWall.h"
#include "server/tools/walls/PvxWall.h"
#include "server/tools/walls/SgctWall.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

const std::string kSamples = TESSERA_SOURCE_DIR "/tests/data/walls/", kShipped = TESSERA_SOURCE_DIR "/deploy/walls/";

std::string textOfSample(const std::string& name) {
    std::ifstream in(kSamples + name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// A sample with another text in it.
std::string changed(const std::string& name, const std::string& from, const std::string& to) {
    std::string text = textOfSample(name);
    EXPECT_NE(text.find(from), std::string::npos) << name << ": " << from;
    if (const std::size_t at = text.find(from); at != std::string::npos) text.replace(at, from.size(), to);
    return text;
}

std::string errorOf(const Expected<ForeignWall>& made) {
    return made ? "accepted" : made.error().message;
}

void expectNotes(const ForeignWall& made) {
    EXPECT_FALSE(made.notes.empty());
    for (const std::string& note : made.notes) EXPECT_WORDS(note);
}

/// The same corners, eyes, tiles and pixels, whatever things are called. `moved`: where its origin is in the other's.
void expectSameWall(const Wall& made, const Wall& shipped, const Vec3d& moved) {
    ASSERT_EQ(made.screens.size(), shipped.screens.size());
    for (std::size_t i = 0; i < made.screens.size(); ++i) {
        const Screen &ours = made.screens[i], &theirs = shipped.screens[i];
        EXPECT_LT((ours.lowerLeft + moved - theirs.lowerLeft).norm(), 1e-9) << ours.name << ours.lowerLeft.transpose();
        EXPECT_LT((ours.lowerRight + moved - theirs.lowerRight).norm(), 1e-9)
            << ours.name << ours.lowerRight.transpose();
        EXPECT_LT((ours.upperLeft + moved - theirs.upperLeft).norm(), 1e-9) << ours.name << ours.upperLeft.transpose();
        EXPECT_EQ(ours.grid.columns, theirs.grid.columns);
        EXPECT_EQ(ours.grid.rows, theirs.grid.rows);
        EXPECT_EQ(ours.grid.tileWidthPx, theirs.grid.tileWidthPx);
        EXPECT_EQ(ours.grid.tileHeightPx, theirs.grid.tileHeightPx);
        EXPECT_EQ(ours.grid.bezelXPx + ours.grid.bezelYPx + ours.grid.overlapXPx + ours.grid.overlapYPx, 0);
    }
    ASSERT_EQ(made.users.size(), 1u);
    for (const Eye eye : {Eye::kCenter, Eye::kLeft, Eye::kRight})
        EXPECT_LT((made.users[0].eye(eye) + moved - shipped.users[0].eye(eye)).norm(), 1e-9);
    ASSERT_EQ(made.hosts.size(), shipped.hosts.size());
    for (std::size_t i = 0; i < made.hosts.size(); ++i) {
        EXPECT_EQ(made.hosts[i].name, shipped.hosts[i].name);
        ASSERT_EQ(made.hosts[i].tiles.size(), shipped.hosts[i].tiles.size());
        EXPECT_EQ(made.hosts[i].tiles[0].column, shipped.hosts[i].tiles[0].column);
        EXPECT_EQ(made.hosts[i].tiles[0].row, shipped.hosts[i].tiles[0].row);
        EXPECT_EQ(made.hosts[i].tiles[0].eye, shipped.hosts[i].tiles[0].eye);
    }
}

TEST(ForeignWall, FourDisplaysAreTheShippedWallInEachFormat) {
    const Wall shipped = loadWall(kShipped + "2x2.wall").value();
    for (const char* file : {"two-by-two.json", "two-by-two.ndisplay", "two-by-two.xml", "two-by-two.pvx"}) {
        SCOPED_TRACE(file);
        const auto made = readForeignWall(kSamples + file);
        ASSERT_TRUE(made) << made.error().message;
        // ParaView's origin is between the eyes.
        const bool atEyes = std::string(file).ends_with(".pvx");
        expectSameWall(made->wall, shipped, atEyes ? Vec3d(0, 1.7, 2.4) : Vec3d(0, 0, 0));
    }
}

TEST(ForeignWall, ARoomIsTheShippedRoomInEachFormat) {
    const Wall shipped = loadWall(kShipped + "cave4.wall").value();
    for (const char* file : {"room.json", "room.ndisplay", "room.xml", "room.pvx"}) {
        SCOPED_TRACE(file);
        const auto made = readForeignWall(kSamples + file);
        ASSERT_TRUE(made) << made.error().message;
        expectSameWall(made->wall, shipped, std::string(file).ends_with(".pvx") ? Vec3d(0, 1.7, 1.4) : Vec3d(0, 0, 0));
    }
}

TEST(ForeignWall, WhatIsSavedCanBeLoaded) {
    const test::TestFolder folder;
    const auto made = readForeignWall(kSamples + "two-by-two.json").value();
    ASSERT_TRUE(saveForeignWall(made, folder / "hall.wall"));
    const auto loaded = loadWall(folder / "hall.wall");
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->screens[0].lowerLeft, loadWall(kShipped + "2x2.wall")->screens[0].lowerLeft) << "in every bit";
    EXPECT_EQ(loaded->hosts[2].machine->ssh, "upper-left");
}

TEST(ForeignWall, AFullDiskLeavesTheWallThatWasThere) {
    const test::TestFolder folder;
    const auto made = readForeignWall(kSamples + "two-by-two.json").value();
    ASSERT_TRUE(saveForeignWall(made, folder / "hall.wall"));
    const auto before = std::filesystem::file_size(folder / "hall.wall");
    rlimit limit{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &limit), 0);
    const rlimit small{.rlim_cur = 100, .rlim_max = limit.rlim_max};
    const auto former = std::signal(SIGXFSZ, SIG_IGN);
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const Expected<void> saved = saveForeignWall(made, folder / "hall.wall");
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
    std::signal(SIGXFSZ, former);
    ASSERT_FALSE(saved);
    EXPECT_WORDS(saved.error().message);
    EXPECT_EQ(std::filesystem::file_size(folder / "hall.wall"), before);
    EXPECT_FALSE(std::filesystem::exists(folder / "hall.wall.new"));
}

TEST(ForeignWall, AnglesTurnAsEachProgramTurns) {
    // Computed by hand, from what each program's own formula does with one odd turn.
    std::string odd = textOfSample("room.json");
    for (const auto& [from, to] :
         {std::pair{"\"yaw\": 0", "\"yaw\": 30"}, {"\"pitch\": 0", "\"pitch\": 20"}, {"\"roll\": 0", "\"roll\": 10"}})
        odd.replace(odd.find(from), std::string_view(from).size(), to);
    const auto sgct = wallOfSgct(odd, "s.json");
    ASSERT_TRUE(sgct) << sgct.error().message;
    // Turned by yaw 30 degrees to the right, pitch 20 up, roll 10 clockwise about its middle (0, 1.2, 1.2): its normal,
    // towards the eyes, is (-sin 30 cos 20, -sin 20, cos 30 cos 20).
    const Screen& turned = sgct->wall.screens[0];
    const Vec3d right = (turned.lowerRight - turned.lowerLeft).normalized(),
                up = (turned.upperLeft - turned.lowerLeft).normalized();
    const double y = radiansOf(30), p = radiansOf(20), r = radiansOf(10);
    EXPECT_LT((right.cross(up) - Vec3d(-std::sin(y) * std::cos(p), -std::sin(p), std::cos(y) * std::cos(p))).norm(),
              1e-8);
    EXPECT_NEAR(right.y(), -std::sin(r) * std::cos(p), 1e-8) << "clockwise: its right side goes down";

    std::string text = textOfSample("room.ndisplay");
    const std::size_t floor = text.find("\"pitch\": -90");
    text.replace(floor, 12, "\"pitch\": -60");
    const auto tilted = wallOfNdisplay(text, "n.ndisplay").value();
    const Screen& ramp = tilted.wall.screens[3];
    const Vec3d upwards = (ramp.upperLeft - ramp.lowerLeft).normalized();
    EXPECT_LT((upwards - Vec3d(0, std::cos(radiansOf(60)), -std::sin(radiansOf(60)))).norm(), 1e-8)
        << upwards.transpose();

    const auto cover =
        wallOfCover(changed("room.xml", "h=\"0.0\" p=\"0.0\" r=\"0.0\"", "h=\"30\" p=\"20\" r=\"10\""), "c.xml")
            .value();
    const Screen& front = cover.wall.screens[0];
    // The rows of MAKE_EULER_MAT: X (right) and Z (up) of the screen, in X right, Y ahead, Z up.
    const double h = radiansOf(30), pp = radiansOf(20), rr = radiansOf(10);
    const double sh = std::sin(h), ch = std::cos(h), sp = std::sin(pp), cp = std::cos(pp), sr = std::sin(rr),
                 cr = std::cos(rr);
    const Vec3d x(ch * cr - sh * sr * sp, cr * sh + ch * sr * sp, -sr * cp),
        z(sp * cr * sh + sr * ch, sr * sh - sp * cr * ch, cp * cr);
    EXPECT_LT(((front.lowerRight - front.lowerLeft) / 2.4 - Vec3d(x.x(), x.z(), -x.y())).norm(), 1e-8);
    EXPECT_LT(((front.upperLeft - front.lowerLeft) / 2.4 - Vec3d(z.x(), z.z(), -z.y())).norm(), 1e-8);
}

TEST(ForeignWall, HeadsTurnAndEyesFollow) {
    const auto unreal = wallOfNdisplay(textOfSample("two-by-two.ndisplay"), "n").value();
    EXPECT_EQ(unreal.wall.users[0].eyeSeparationMetres, 0.065);
    // A head that looks to the right has its right eye behind it.
    std::string text = textOfSample("two-by-two.ndisplay");
    const std::size_t camera = text.find("\"yaw\": 0", text.find("DefaultViewPoint"));
    text.replace(camera, 8, "\"yaw\": 90");
    const User looking = wallOfNdisplay(text, "n").value().wall.users[0];
    EXPECT_LT((looking.eye(Eye::kRight) - Vec3d(0, 1.7, 2.4 + 0.0325)).norm(), 1e-9)
        << looking.eye(Eye::kRight).transpose();
    const User sgct =
        wallOfSgct(changed("two-by-two.json", "\"eyeseparation\": 0.065,",
                           "\"eyeseparation\": 0.065, \"orientation\": {\"yaw\": 90, \"pitch\": 0, \"roll\": 0},"),
                   "s")
            .value()
            .wall.users[0];
    EXPECT_LT((sgct.eye(Eye::kRight) - Vec3d(0, 1.7, 2.4 + 0.0325)).norm(), 1e-9);
    const User matrix =
        wallOfSgct(changed("two-by-two.json", "\"eyeseparation\": 0.065,",
                           "\"eyeseparation\": 0.065, \"matrix\": [0,0,1,0, 0,1,0,0, -1,0,0,0, 1,2,3,1],"),
                   "s")
            .value()
            .wall.users[0];
    EXPECT_LT((matrix.eye(Eye::kRight) - Vec3d(1, 2, 3.0325)).norm(), 1e-9) << matrix.eye(Eye::kRight).transpose();
}

TEST(ForeignWall, FramesBetweenDisplaysAreHiddenPixels) {
    // Three displays of 1.6 m and 960 pixels, 30 pixels apart; then 30.3.
    const auto wall = [](double gapM) {
        std::string machines;
        for (int i = 0; i < 3; ++i) {
            const double x = i * (1.6 + gapM);
            machines += "<Machine Name=\"d" + std::to_string(i) + "\" Geometry=\"960x540+0+0\" LowerLeft=\"" +
                        std::to_string(x) + " 0 -2\" LowerRight=\"" + std::to_string(x + 1.6) +
                        " 0 -2\" UpperRight=\"" + std::to_string(x + 1.6) + " 0.9 -2\"/>";
        }
        return wallOfPvx("<pvx>" + machines + "</pvx>", "p.pvx").value();
    };
    const ForeignWall whole = wall(0.05);
    ASSERT_EQ(whole.wall.screens.size(), 1u);
    EXPECT_EQ(whole.wall.screens[0].grid.columns, 3);
    EXPECT_EQ(whole.wall.screens[0].grid.bezelXPx, 30);
    EXPECT_NEAR(whole.wall.screens[0].widthMetres(), 4.9, 1e-9);
    const ForeignWall odd = wall(0.0505);
    EXPECT_EQ(odd.wall.screens.size(), 3u);
    expectNotes(odd);
    const ForeignWall over = wall(-0.1);
    EXPECT_EQ(over.wall.screens[0].grid.overlapXPx, 60);
    expectNotes(over);
}

TEST(ForeignWall, EyesComeAsTheirProgramSays) {
    const auto packed = [](const char* mode, int height) {
        return wallOfSgct(changed("room.json", "\"fullscreen\": false,",
                                  "\"stereo\": \"" + std::string(mode) +
                                      "\", \"res\": {\"x\": 800, \"y\": " + std::to_string(height) + "},"),
                          "s")
            .value()
            .wall.hosts[0];
    };
    const WallHost beside = packed("side_by_side_inverted", 800);
    ASSERT_EQ(beside.tiles.size(), 2u);
    EXPECT_EQ(beside.tiles[0].output.stereo, StereoPacking::kSideBySide);
    EXPECT_TRUE(beside.tiles[0].output.swapEyes);
    EXPECT_EQ(beside.tiles[1].eye, Eye::kRight);
    // Rows are counted from below there, from above here: the same row's parity is another where their number is even.
    EXPECT_TRUE(packed("vertical_interlaced", 800).tiles[0].output.swapEyes);
    EXPECT_FALSE(packed("vertical_interlaced", 801).tiles[0].output.swapEyes);

    const std::string pair =
        "<pvx><Machine Name=\"a\" StereoType=\"Left\" Geometry=\"800x600\" LowerLeft=\"-2 -1 -2\" LowerRight=\"0 -1 "
        "-2\" UpperRight=\"0 1 -2\"/><Machine Name=\"b\" StereoType=\"Right\" Geometry=\"800x600\" LowerLeft=\"-2 -1 "
        "-2\" LowerRight=\"0 -1 -2\" UpperRight=\"0 1 -2\"/></pvx>";
    const ForeignWall two = wallOfPvx(pair, "p").value();
    EXPECT_EQ(two.wall.screens.size(), 1u);
    EXPECT_EQ(two.wall.hosts[0].tiles[0].eye, Eye::kLeft);
    EXPECT_EQ(two.wall.hosts[1].tiles[0].eye, Eye::kRight);
    const ForeignWall one = wallOfPvx(pair.substr(0, pair.find("<Machine Name=\"b\"")) + "</pvx>", "p").value();
    EXPECT_EQ(one.wall.hosts[0].tiles[0].eye, Eye::kCenter);
    expectNotes(one);

    const ForeignWall off =
        wallOfCover(changed("room.xml", "<Stereo value=\"ON\"", "<Stereo value=\"OFF\""), "c").value();
    EXPECT_EQ(off.wall.users[0].eyeSeparationMetres, 0);
}

TEST(ForeignWall, TwoComputersOfOneScreenAreTwoEyes) {
    // As OpenCOVER's caves are written: sections that name several computers, the later one counts; a desk shows the
    // front in a window, a computer for each eye of a screen, and its picture is a part of its window.
    const auto cave = wallOfCover(R"(<?xml version="1.0"?><COCONFIG version="1">
      <GLOBAL><COVER><NumScreens value="0"/><NumWindows value="0"/></COVER></GLOBAL>
      <CLUSTER MASTER="desk"><COVER><MultiPC><SyncMode value="TCP" hosts="desk,f-right,f-left,l-right,l-left"/>
        </MultiPC>
        <ViewerPosition x="0" y="-3000" z="200"/><Stereo enable="ON" value="ON"/></COVER></CLUSTER>
      <LOCAL HOST="desk"><COVER><ScreenConfig>
        <Screen width="2700" comment="FRONT" h="0.0" originX="0" originY="1350" originZ="0" height="2700" p="0.0"
        r="0.0" name="0"/></ScreenConfig>
        <WindowConfig><Window ARCH="x11" width="1920" height="1080" name="0"/></WindowConfig>
        <ChannelConfig><Channel stereoMode="LEFT" windowIndex="0" viewportIndex="0" name="0"/></ChannelConfig>
          </COVER></LOCAL>
      <LOCAL HOST="f-right, f-left ,visitor"><COVER><ScreenConfig>
        <Screen width="2700" comment="FRONT" originX="0" originY="1350" originZ="0" height="2700" name="0"/>
        <Screen width="2700" comment="FRONT" originX="0" originY="1350" originZ="0" height="2700" name="1"/>
          </ScreenConfig></COVER></LOCAL>
      <LOCAL HOST="l-right,l-left"><COVER><ScreenConfig>
        <Screen width="2700" comment="LEFT" h="90.0" originX="-1350" originY="0" originZ="0" height="2700"
          name="0"/></ScreenConfig></COVER></LOCAL>
      <LOCAL HOST="f-right,f-left,l-right,l-left"><COVER><WindowConfig>
        <Window ARCH="windows" width="640" height="480" name="0"/>
        <Window ARCH="x11" width="1920" height="1200" name="0"/></WindowConfig>
        <ViewportConfig><Viewport width="1201" left="363" windowIndex="0" bottom="0" name="0" height="1200"/>
          </ViewportConfig></COVER></LOCAL>
      <LOCAL HOST="f-left,l-left,"><COVER><ChannelConfig>
        <Channel stereoMode="LEFT" windowIndex="0" name="0" viewportIndex="0"/></ChannelConfig></COVER></LOCAL>
      <LOCAL HOST="f-right,l-right"><COVER><ChannelConfig>
        <Channel stereoMode="RIGHT" windowIndex="0" name="0" viewportIndex="0"/></ChannelConfig></COVER></LOCAL>
      <LOCAL HOST="desk,f-right,f-left,l-right,l-left"><COVER><NumWindows value="1"/><NumScreens value="1"/>
        </COVER></LOCAL></COCONFIG>)",
                                  "cave.xml");
    ASSERT_TRUE(cave) << cave.error().message;
    ASSERT_EQ(cave->wall.screens.size(), 3u) << "the desk's window has other pixels";
    EXPECT_EQ(cave->wall.screens[1].name, "FRONT-2");
    EXPECT_EQ(cave->wall.screens[1].grid.tileWidthPx, 1201);
    EXPECT_EQ(cave->wall.screens[1].grid.tileHeightPx, 1200);
    const Screen& left = cave->wall.screens[2];
    EXPECT_LT((left.lowerLeft - Vec3d(-1.35, -1.35, 1.35)).norm(), 1e-9) << left.lowerLeft.transpose();
    EXPECT_LT((left.lowerRight - Vec3d(-1.35, -1.35, -1.35)).norm(), 1e-9) << left.lowerRight.transpose();
    EXPECT_EQ(cave->wall.users[0].eyeSeparationMetres, 0.064);
    EXPECT_LT((cave->wall.users[0].position - Vec3d(0, 0.2, 3)).norm(), 1e-9);
    ASSERT_EQ(cave->wall.hosts.size(), 5u);
    EXPECT_EQ(cave->wall.hosts[0].tiles[0].eye, Eye::kCenter) << "nobody has the desk's right eye";
    EXPECT_EQ(cave->wall.hosts[1].tiles[0].eye, Eye::kRight);
    EXPECT_EQ(cave->wall.hosts[2].tiles[0].eye, Eye::kLeft);
    EXPECT_EQ(cave->wall.hosts[2].machine->ssh, "f-left");
}

TEST(ForeignWall, WhatIsNotCarriedOverIsASentence) {
    const auto says = [](const Expected<ForeignWall>& made) {
        ASSERT_TRUE(made) << made.error().message;
        expectNotes(*made);
    };
    says(wallOfSgct(changed("room.json", "\"type\": \"PlanarProjection\"", "\"type\": \"FisheyeProjection\""), "s"));
    says(wallOfSgct(changed("room.json", "\"users\"", "\"scene\": {\"scale\": 2}, \"users\""), "s"));
    says(wallOfSgct(changed("room.json", "\"projection\"", "\"mesh\": \"a.pfm\", \"projection\""), "s"));
    says(wallOfSgct(changed("room.json", "\"fullscreen\": false,", "\"draw3d\": false,"), "s"));
    says(wallOfNdisplay(changed("room.ndisplay", "\"type\": \"simple\"", "\"type\": \"mpcdi\""), "n"));
    says(wallOfPvx(changed("room.pvx", "Geometry=\"800x800\"", ""), "p"));
    says(wallOfPvx(
        changed("room.pvx", "<Machine Name=\"front\"", "<Machine Name=\"front\" Environment=\"DISPLAY=:0.1\""), "p"));
    says(wallOfCover(changed("room.xml", "<GLOBAL>", "<INCLUDE>more.xml</INCLUDE><GLOBAL>"), "c"));
    says(wallOfCover(changed("room.xml", "<NumWindows", "<Input/><NumWindows"), "c"));
    // A note quotes the file: it ends up in a comment of the wall.
    const test::TestFolder folder;
    const auto made =
        wallOfNdisplay(changed("room.ndisplay", "\"type\": \"simple\"", "\"type\": \"x\\nhosts { }\""), "n").value();
    ASSERT_TRUE(saveForeignWall(made, folder / "w.wall"));
    const auto loaded = loadWall(folder / "w.wall");
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->hosts.size(), 3u);
}

TEST(ForeignWall, WhatIsWrongIsSaidWithItsPlace) {
    EXPECT_WORDS(errorOf(wallOfSgct("{", "hall.json")));
    EXPECT_WORDS(errorOf(wallOfSgct(changed("room.json", "\"hfov\": 90", "\"hfov\": 190"), "h")));
    EXPECT_WORDS(errorOf(wallOfSgct(changed("room.json", "\"z\": 1.2", "\"z\": \"far\""), "h")));
    EXPECT_WORDS(errorOf(wallOfSgct(changed("two-by-two.json", "\"upperleft\"", "\"uperleft\""), "h")));
    EXPECT_WORDS(errorOf(wallOfSgct(changed("room.json", "\"projection\"", "\"user\": \"x\", \"projection\""), "h")));
    EXPECT_WORDS(errorOf(wallOfSgct("{\"masteraddress\": \"\"}", "h")));
    EXPECT_WORDS(errorOf(wallOfPvx("<pvx><Machine", "hall.pvx")));
    EXPECT_WORDS(errorOf(wallOfPvx("<px/>", "h")));
    EXPECT_WORDS(errorOf(wallOfPvx("<pvx><Machine Name=\"a\" Geometry=\"8x6\"/></pvx>", "h")));
    EXPECT_WORDS(
        errorOf(wallOfPvx(changed("room.pvx", "LowerLeft=\"-1.2 -1.7 -1.4\"", "LowerLeft=\"-1.2 nan\""), "h")));
    EXPECT_WORDS(errorOf(wallOfPvx(changed("room.pvx", "Geometry=\"800x800\"", "Geometry=\"wide\""), "h")));
    EXPECT_WORDS(errorOf(wallOfNdisplay("[cluster_node]", "h")));
    EXPECT_WORDS(
        errorOf(wallOfNdisplay(changed("room.ndisplay", "\"parentId\": \"middle\"", "\"parentId\": \"midle\""), "h")));
    EXPECT_WORDS(
        errorOf(wallOfNdisplay(changed("room.ndisplay", "\"parentId\": \"\"", "\"parentId\": \"middle\""), "h")));
    EXPECT_WORDS(errorOf(
        wallOfNdisplay(changed("room.ndisplay", "\"screen\": \"scr_front\"", "\"screen\": \"scr_frnt\""), "h")));
    EXPECT_WORDS(errorOf(wallOfCover("<COCONFIG/>", "h")));
    EXPECT_WORDS(errorOf(wallOfCover(changed("room.xml", "originX=\"-1200\"", "originX=\"-12oo\""), "h")));
    EXPECT_WORDS(
        errorOf(wallOfPvx(changed("room.pvx", "UpperRight=\"1.2 0.7 -1.4\"", "UpperRight=\"1.9 0.7 -1.4\""), "h")));
    // The one who wrote it measured in millimetres.
    std::string large = textOfSample("room.pvx");
    for (std::size_t at = 0; (at = large.find("1.2", at)) != std::string::npos; at += 5) large.replace(at, 3, "900");
    EXPECT_WORDS(errorOf(wallOfPvx(large, "h")));
}

TEST(ForeignWall, FilesAreKnownByWhatTheyHold) {
    const test::TestFolder folder;
    const auto read = [&](const std::string& name, const std::string& text) {
        std::ofstream(folder / name, std::ios::binary) << text;
        return errorOf(readForeignWall(folder / name));
    };
    EXPECT_EQ(read("any.txt", textOfSample("room.json")), "accepted");
    EXPECT_EQ(read("any.json", textOfSample("room.ndisplay")), "accepted");
    EXPECT_EQ(read("config.cave.xml", textOfSample("room.xml")), "accepted");
    EXPECT_WORDS(read("hall.json", "{}"));
    EXPECT_WORDS(read("hall.pvx", "?"));
    EXPECT_WORDS(read("old.xml", "<?xml version=\"1.0\"?><Cluster masterAddress=\"localhost\"/>"));
    EXPECT_WORDS(read("old.cfg", "[cluster_node] id=\"node\""));
    EXPECT_WORDS(read("large.pvx", std::string(5 << 20, ' ')));
    EXPECT_WORDS(errorOf(readForeignWall(folder / "none.pvx")));
    EXPECT_WORDS(errorOf(readForeignWall(folder / ".")));
    EXPECT_LE(wallFormatList().size(), 78u) << "a line of --help";
    EXPECT_EQ(wallFormats().size(), 5u);
}

TEST(ForeignWall, AFileOfManyComputersIsReadOnce) {
    std::string hosts;
    for (int i = 0; i < 256; ++i) hosts += (i > 0 ? ",h" : "h") + std::to_string(i);
    const auto file = [&](const std::string& sections) {
        return "<COCONFIG><GLOBAL><COVER><MultiPC><SyncMode hosts=\"" + hosts + "\"/></MultiPC><ScreenConfig>" +
               "<Screen name=\"0\" originX=\"5\" width=\"2000\"/></ScreenConfig></COVER></GLOBAL>" + sections +
               "</COCONFIG>";
    };
    std::string settings, keys;
    for (int i = 0; i < 100'000; ++i) settings += "<Stereo value=\"on\"/>";
    for (int i = 0; i < 100'000; ++i) keys += "<S" + std::to_string(i) + " name=\"0.5\" a=\"\"/>";
    // What holds for any computer, and 256 take it: these would be 25 million words.
    const auto any = wallOfCover(file("<LOCAL><COVER>" + settings + "<ScreenConfig>" + keys +
                                      "<Screen name=\"0\" width=\"3000\"/></ScreenConfig></COVER></LOCAL>"),
                                 "h");
    ASSERT_TRUE(any) << errorOf(any);
    EXPECT_NEAR(any->wall.screens[0].lowerRight.x() - any->wall.screens[0].lowerLeft.x(), 3, 1e-9);
    EXPECT_NEAR(any->wall.screens[0].lowerLeft.x(), 0.005 - 1.5, 1e-9);
    // And where it stands in a section that names them all, it is said so often.
    EXPECT_WORDS(
        errorOf(wallOfCover(file("<LOCAL HOST=\"" + hosts + "\"><COVER>" + settings + "</COVER></LOCAL>"), "h")));
}

// Unreal saves what has an umlaut in UTF-16.
TEST(ForeignWall, TextsMayBeUtf16) {
    const test::TestFolder folder;
    for (const bool bigEnds : {false, true})
        for (const char* name : {"room.json", "room.ndisplay", "room.xml", "room.pvx"}) {
            std::string wide(bigEnds ? "\xFE\xFF" : "\xFF\xFE");
            for (const char c : textOfSample(name)) (wide += bigEnds ? '\0' : c) += bigEnds ? c : '\0';
            std::ofstream(folder / name, std::ios::binary) << wide;
            EXPECT_EQ(errorOf(readForeignWall(folder / name)), "accepted") << name;
            // Halves of pairs, and half a unit.
            std::ofstream(folder / name, std::ios::binary) << wide.substr(0, 2) << "\xD8\xD8\xDC\xDC\xD8";
            EXPECT_NE(errorOf(readForeignWall(folder / name)), "accepted") << name;
        }
}

TEST(ForeignWall, APipeIsNotWaitedFor) {
    const test::TestFolder folder;
    ASSERT_EQ(::mkfifo((folder / "hall.json").c_str(), 0600), 0);
    EXPECT_WORDS(errorOf(readForeignWall(folder / "hall.json")));
    std::ofstream(folder / "room.json") << textOfSample("room.json");
    EXPECT_WORDS(errorOf(readForeignWall(folder / "rom.json")));
}

TEST(ForeignWall, FilesThatMeanIllEndWithWords) {
    std::mt19937 random(45);
    for (const char* file : {"two-by-two.json", "room.ndisplay", "room.xml", "room.pvx"}) {
        const std::string whole = textOfSample(file);
        const std::span<const WallFormat> formats = wallFormats();
        const auto format = std::ranges::find_if(formats, [&](const WallFormat& one) { return one.knows(whole); });
        for (int i = 0; i < 400; ++i) {
            std::string damaged = whole;
            for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = "\"<>{}[]:,0-9eE.xX\0\xff"[random() % 19];
            if (random() % 5 == 0) damaged.resize(random() % damaged.size());
            const auto made = format->read(file, damaged);
            if (!made) {
                EXPECT_FALSE(made.error().message.empty());
            }
        }
    }
    EXPECT_WORDS(errorOf(wallOfSgct(std::string(200'000, '['), "h")));
    std::string deep, many = "<COCONFIG>";
    for (int i = 0; i < 100'000; ++i) deep += "<a>";
    EXPECT_WORDS(errorOf(wallOfCover(deep, "h")));
    for (int i = 0; i < 2000; ++i) many += "<LOCAL HOST=\"h" + std::to_string(i) + "\"/>";
    EXPECT_WORDS(errorOf(wallOfCover(many + "</COCONFIG>", "h")));
    std::string heads;
    for (int i = 0; i < 100'000; ++i) heads += ",{}";
    EXPECT_WORDS(errorOf(wallOfSgct(changed("room.json", "\"users\": [", "\"users\": [{}" + heads + ","), "h")));
    std::string machines = "<pvx>";
    for (int i = 0; i < 5000; ++i)
        machines += "<Machine Geometry=\"8x8\" LowerLeft=\"0 0 -" + std::to_string(i % 900 + 1) +
                    "\" LowerRight=\"1 0 -1\" UpperRight=\"1 1 -1\"/>";
    EXPECT_WORDS(errorOf(wallOfPvx(machines + "</pvx>", "h")));
}

}  // namespace
}  // namespace tessera
