/// From the command's options to the pictures, with scripts in the roles of server and clients.
#include "deploy/wall/Launch.h"

#include <fmt/format.h>

#include <filesystem>

#include "common/base/Version.h"
#include "common/codec/WallCodec.h"
#include "common/image/Picture.h"
#include "common/image/SharedFrame.h"
#include "common/wall/PictureLayout.h"
#include "deploy/wall/Film.h"
#include "deploy/wall/Stitch.h"
#include "deploy/wall/TileImages.h"
#include "tests/unit/launcher/Stage.h"

namespace tessera {
namespace {

constexpr const char* kWall = R"(
screens { name: "front" lower_left { x: -1.6 y: 0.6 } lower_right { x: 1.6 y: 0.6 } upper_left { x: -1.6 y: 2.4 }
  grid { columns: 2 rows: 2 tile_width_px: 8 tile_height_px: 4 bezel_x_px: 2 bezel_y_px: 1 } }
users { name: "viewer" position { y: 1.7 z: 2.4 } }
hosts { name: "lower" tiles { screen: "front" column: 0 row: 0 user: "viewer" }
  tiles { screen: "front" column: 1 row: 0 user: "viewer" } }
hosts { name: "upper" tiles { screen: "front" column: 0 row: 1 user: "viewer" }
  tiles { screen: "front" column: 1 row: 1 user: "viewer" } }
)";

using Rgb = std::array<std::uint8_t, 3>;
constexpr Rgb kRed{250, 0, 0}, kGreen{0, 250, 0}, kBlue{0, 0, 250}, kWhite{250, 250, 250}, kDark{14, 14, 14};

Rgb pixel(const Picture& picture, int x, int y) {
    const std::size_t at =
        3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.widthPx) + static_cast<std::size_t>(x));
    return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

Picture tileOf(const Rgb& c) {
    return Picture::filled(8, 4, c[0], c[1], c[2]);
}

class Launching : public test::Stage {
protected:
    Launching() {
        std::ofstream(folder_ / "lab.wall") << kWall;
        options_.wall = (folder_ / "lab.wall").string();
        options_.scenes = {"hall.tsct"};
        options_.frames = 3;
        options_.output = (folder_ / "out").string();
        options_.executable = (folder_ / "tessera-wall").string();
        // Images for the players to put where clients would.
        for (const auto& [name, color] :
             {std::pair{"red", kRed}, {"green", kGreen}, {"blue", kBlue}, {"white", kWhite}})
            save((folder_ / name).string() + ".png", tileOf(color), 2);
    }
    static void save(const std::string& path, const Picture& picture, std::uint64_t frame) {
        ASSERT_TRUE(writeFile(path, encodePng(picture, frame)));
    }
    [[nodiscard]] Picture load(const std::string& name) const {
        const Expected<Bytes> bytes = readFile(options_.output + "/" + name, 1 << 20);
        EXPECT_TRUE(bytes) << name;
        if (!bytes) return Picture::filled(1, 1, 0, 0, 0);
        return decodePng(*bytes)->picture;
    }
    int launchWith(const std::string& server, const std::string& client) {
        program("tessera-server", R"(
            report=; while [ $# -gt 0 ]; do [ "$1" = --report ] && report=$2; echo "$1" >>$S/server.args; shift; done
            echo 'tessera-server: listening on 127.0.0.1:4711'
            done_well() {
                echo '{"frames":3,"frame_ms":{"p50":12.5},"faults":[],' >$report
                echo '"sync":{"waits":[{"tile":"front-1-0","host":"b","frames":2,"ms":9,"reason":"draw"}]}}' >>$report
                exit 0
            }
            )" + server);
        program("tessera-client",
                "host=$4; echo \"$@\" >>$S/client.args\nput() { mkdir -p $S/out/tiles/$1; cp $S/$2.png "
                "$S/out/tiles/$1/$3.png; }\n" +
                    client);
        Expected<Signals> signals = Signals::take();
        return launch(options_, *signals, console());
    }
    static constexpr const char* kGoodClient = R"(
        if [ $host = lower ]; then put front-0-0 red 000002; put front-1-0 green 000002; touch $S/lower
        else put front-0-1 blue 000002; put front-1-1 white 000002; touch $S/upper; fi)";

    LaunchOptions options_;
};

TEST_F(Launching, WhatLiesBesideTheScenesMayBeLoaded) {
    options_.scenes = {(folder_ / "hall.tsct").string(), (folder_ / "more" / "engine.glb").string(),
                       "asset://crate.glb", "/hall.tsct"};
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", kGoodClient), 0) << said();
    const std::string words = read(folder_ / "server.args");
    EXPECT_NE(words.find("--allow\n" + folder_.string() + "\n"), std::string::npos) << words;
    EXPECT_NE(words.find("--allow\n" + (folder_ / "more").string() + "\n"), std::string::npos) << words;
    EXPECT_EQ(words.find("--allow\n/\n"), std::string::npos)
        << "beside a scene in the root folder lies everything: " << words;
}

TEST_F(Launching, LeavesTheMosaicAndWhatAVisitorSees) {
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", kGoodClient), 0) << said();
    const Picture mosaic = load("wall.png");
    ASSERT_EQ(mosaic.widthPx, 16);
    ASSERT_EQ(mosaic.heightPx, 8);
    EXPECT_EQ(pixel(mosaic, 0, 7), kRed) << "column 0, row 0 is at the lower left";
    EXPECT_EQ(pixel(mosaic, 8, 4), kGreen);
    EXPECT_EQ(pixel(mosaic, 7, 3), kBlue);
    EXPECT_EQ(pixel(mosaic, 15, 0), kWhite);
    const Picture bezels = load("wall-bezels.png");
    ASSERT_EQ(bezels.widthPx, 18);
    ASSERT_EQ(bezels.heightPx, 9);
    EXPECT_EQ(pixel(bezels, 7, 8), kRed);
    EXPECT_EQ(pixel(bezels, 8, 8), kDark);
    EXPECT_EQ(pixel(bezels, 9, 8), kDark);
    EXPECT_EQ(pixel(bezels, 10, 8), kGreen);
    EXPECT_EQ(pixel(bezels, 0, 4), kDark) << "the frame between the rows";
    EXPECT_EQ(pixel(bezels, 10, 3), kWhite);
    EXPECT_SAID("3 frames, 12.5 ms each (median), 0 faults\n");
    EXPECT_SAID("waited longest for tile front-1-0 of host b: in 2 frames, 4.5 ms each; reason: draw\n");
}

TEST_F(Launching, LeavesWhatEachProjectorGets) {
    std::string wall = kWall;
    const std::string first = "column: 0 row: 0 user: \"viewer\"";
    wall.replace(wall.find(first), first.size(), first + " output { gain { r: 0 } }");
    std::ofstream(folder_ / "lab.wall") << wall;
    options_.outputs = true;
    std::filesystem::create_directories(options_.output + "/outputs");
    std::ofstream(options_.output + "/outputs/front-1-1.png") << "of an earlier run";
    // The upper right tile shows nothing.
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", R"(
        if [ $host = lower ]; then put front-0-0 white 000002; put front-1-0 green 000002; touch $S/lower
        else put front-0-1 blue 000002; touch $S/upper; fi)"),
              0)
        << said();
    EXPECT_EQ(pixel(load("outputs/front-0-0.png"), 3, 2), (Rgb{0, 250, 250})) << "its projector gets no red";
    EXPECT_EQ(pixel(load("outputs/front-1-0.png"), 3, 2), kGreen);
    EXPECT_EQ(pixel(load("wall.png"), 0, 7), kWhite) << "the wall's picture is that of the tiles";
    EXPECT_FALSE(std::filesystem::exists(options_.output + "/outputs/front-1-1.png"));
    EXPECT_SAID("no picture of output front-1-1: tile front-1-1 has shown nothing");
}

TEST_F(Launching, HandsItsOptionsOn) {
    options_.culler = "frustum";
    options_.share = "off";
    options_.camera = "view 2";
    options_.assets = {"/models"};
    options_.samples = 1;
    options_.keepFrames = true;
    options_.size = "16x8";
    options_.record = "hall.rec";
    options_.threads = 3;
    options_.reload = true;
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", kGoodClient), 0) << said();
    const std::string server = read(folder_ / "server.args");
    for (const char* expected :
         {"--wall\n", "lab.wall\n", "--scene\nhall.tsct\n", "--listen\n127.0.0.1:0\n", "--frames\n3\n",
          "--assets\n/models\n", "--size\n16x8\n", "--samples\n1\n", "--camera\nview 2\n", "--record\nhall.rec\n",
          "--threads\n3\n", "--reload\n", "--progress\n", "--quiet\n", "/out/report.json\n"}) {
        EXPECT_NE(server.find(expected), std::string::npos) << expected << server;
    }
    const std::string client = read(folder_ / "client.args");
    EXPECT_NE(client.find("--host lower --output " + options_.output +
                          " --culler frustum --share off --quiet --keep-frames\n"),
              std::string::npos)
        << client;
    EXPECT_EQ(client.find("--verbose"), std::string::npos) << "that is for us";
}

TEST_F(Launching, LetsAllSpeakWhereSomebodyWantsToHear) {
    options_.verbose = true;
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", kGoodClient), 0) << said();
    EXPECT_EQ(read(folder_ / "server.args").find("--quiet"), std::string::npos);
    EXPECT_EQ(read(folder_ / "client.args").find("--quiet"), std::string::npos);
}

TEST_F(Launching, TakesADeadHostsLastImageFromItsSharedFrame) {
    // The player cannot write shared frames; the file is laid ready and put in place by the client before it "dies".
    {
        Expected<SharedFrameWriter> writer = SharedFrameWriter::create((folder_ / "ready.frame").string(), 8, 4);
        ASSERT_TRUE(writer);
        writer->prepare(1, tileOf(kBlue));
        ASSERT_TRUE(writer->show());
    }
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", R"(
        if [ $host = lower ]; then put front-0-0 red 000002; put front-1-0 green 000002; touch $S/lower
        else mkdir -p $S/out/tiles/front-0-1; cp $S/ready.frame $S/out/tiles/front-0-1/shown.frame; touch $S/upper;
          kill -9 $$; fi)"),
              0)
        << said();
    const Picture mosaic = load("wall.png");
    EXPECT_EQ(pixel(mosaic, 0, 0), kBlue);
    EXPECT_EQ(pixel(mosaic, 8, 0), kDark);
    EXPECT_EQ(pixel(mosaic, 8, 7), kGreen);
    EXPECT_SAID("tile front-0-1 of host upper shows frame 1, others frame 2");
    EXPECT_SAID("tile front-1-1 of host upper never showed an image");
}

TEST_F(Launching, DoesNotTakeImagesOfAnEarlierRunForItsOwn) {
    save(options_.output + "/tiles/front-1-1/000119.png", tileOf(kWhite), 119);
    save(options_.output + "/wall.png", tileOf(kWhite), 119);
    std::ofstream(options_.output + "/tiles/front-1-1/notes.txt") << "kept";
    // Of another wall that left its pictures in the same folder.
    for (const char* file : {"/tiles/side-9-0/000119.png", "/outputs/side-9-0-left.png", "/outputs/logo.png"})
        save(options_.output + file, tileOf(kWhite), 119);
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", R"(
        if [ $host = lower ]; then put front-0-0 red 000002; put front-1-0 green 000002; touch $S/lower
        else put front-0-1 blue 000002; touch $S/upper; fi)"),
              0)
        << said();
    EXPECT_EQ(pixel(load("wall.png"), 15, 0), kDark);
    EXPECT_TRUE(has("out/tiles/front-1-1/notes.txt"));
    EXPECT_FALSE(has("out/tiles/side-9-0"));
    EXPECT_FALSE(has("out/outputs/side-9-0-left.png"));
    EXPECT_TRUE(has("out/outputs/logo.png"));
}

TEST_F(Launching, PassesOnTheServersExitCode) {
    save(options_.output + "/wall.png", tileOf(kWhite), 119);
    EXPECT_EQ(launchWith("echo 'tessera-server: error: hall.tsct: no such file' >&2; exit 3", "sleep 5"), 3);
    EXPECT_SAID("tessera-server: error: hall.tsct: no such file\n");
    EXPECT_SAID("tessera-wall: error: the server ended with exit code 3\n");
    EXPECT_FALSE(has("out/wall.png")) << "no picture of an earlier run stands for this one";
}

TEST_F(Launching, ExplainsAWallThatIsWrongBeforeAnythingStarts) {
    std::ofstream(folder_ / "lab.wall") << "screens { nam: \"x\" }";
    EXPECT_EQ(launchWith("exit 0", "exit 0"), 3);
    EXPECT_SAID("lab.wall:1:11: unknown key \"nam\"");
    EXPECT_FALSE(has("server.args"));
    options_.wall = "9x9";
    EXPECT_EQ(launchWith("exit 0", "exit 0"), 3);
    EXPECT_SAID("there is no wall \"9x9\"");
}

TEST_F(Launching, RefusesSizesThatAreNone) {
    for (const char* size : {"1920", "1920x", "x1080", "0x5", "-4x5", "10x10x10", "1e3x5", "99999999999x5", "3x1"}) {
        options_.size = size;
        EXPECT_EQ(launchWith("exit 0", "exit 0"), 2) << size;
    }
    EXPECT_FALSE(has("server.args"));
}

TEST_F(Launching, MissesAReportThatIsNotThere) {
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; exit 0", kGoodClient), 3);
    EXPECT_SAID("report.json");
}

TEST_F(Launching, SaysThatNothingWasShown) {
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", "touch $S/$host"), 1);
    EXPECT_SAID("no tile has shown anything");
}

TEST_F(Launching, HostsElsewhereThatShowNoFrameAreAFailure) {
    std::string wall = kWall;
    for (const std::string host : {"lower", "upper"}) {
        const std::string name = "name: \"" + host + "\"";
        wall.insert(wall.find(name),
                    fmt::format("machine {{ ssh: \"wall-3\" command: \"{}/tessera-client\" }} ", folder_.string()));
    }
    std::ofstream(folder_ / "lab.wall") << wall;
    options_.start = true;
    options_.ssh =
        program("ssh", "for last; do :; done\nexport SSH_CONNECTION='127.0.0.1 1 127.0.0.1 2'\neval \"$last\"");
    const std::string client = fmt::format(R"(
        [ "$1" = --version ] && {{ echo '{}'; exit 0; }}
        case "$*" in *--check*) echo 'check: cores 2'; exit 0;; esac
        touch $S/$host; await $S/over)",
                                           versionText("tessera-client"));
    program("tessera-ctl", "exit 0");
    const auto after = [&](int frames) {
        for (const char* name : {"lower", "upper", "over"}) std::filesystem::remove(folder_ / name);
        return launchWith(fmt::format(R"(await $S/lower; await $S/upper
            echo '{{"frames":{},"frame_ms":{{"p50":12.5}},"faults":[]}}' >$report; touch $S/over; exit 0)",
                                      frames),
                          client);
    };
    EXPECT_EQ(after(0), 1) << said();
    EXPECT_SAID("tessera-wall: error: no host has shown a frame\n");
    EXPECT_EQ(after(3), 0) << said();
}

TEST_F(Launching, RefusesImagesOfAnotherSize) {
    save((folder_ / "wrong.png").string(), Picture::filled(9, 4, 1, 2, 3), 2);
    EXPECT_EQ(launchWith("await $S/lower; await $S/upper; done_well", "put front-0-0 wrong 000002; touch $S/$host"), 3);
    EXPECT_SAID("tile front-0-0 has 9 x 4 pixels, the tile has 8 x 4");
}

TEST_F(Launching, NamesAProgramThatIsNotBesideIt) {
    Expected<Signals> signals = Signals::take();
    EXPECT_EQ(launch(options_, *signals, console()), 3);
    EXPECT_SAID("tessera-server is missing");
}

TEST_F(Launching, MakesAFilmOfAllFrames) {
    const std::optional<std::string> ffmpeg = findProgram("ffmpeg");
    if (!ffmpeg) GTEST_SKIP() << "ffmpeg is not installed";
    const Wall wall = *parseWall(kWall, "lab.wall");
    const PictureLayout layout = layoutPicture(*withSize(wall, 65, 33), PictureKind::kMosaic);
    const TileImages images((folder_ / "tiles").string());
    for (const PictureLayout::Place& place : layout.places) {
        for (int frame = 0; frame < 5; ++frame) {
            if (place.tile == "front-1-1" && frame > 2) continue;  // its host died
            save((folder_ / "tiles" / place.tile).string() + "/00000" + std::to_string(frame) + ".png",
                 Picture::filled(place.widthPx, place.heightPx, 50, 60, 70), static_cast<std::uint64_t>(frame));
        }
    }
    Expected<Signals> signals = Signals::take();
    const std::string path = (folder_ / "wall.mp4").string();
    const Expected<bool> written = writeFilm(*ffmpeg, path, layout, images, *signals, console());
    ASSERT_TRUE(written) << written.error().message;
    EXPECT_TRUE(*written);
    EXPECT_EQ(read(path).substr(4, 4), "ftyp");
    EXPECT_FALSE(has("wall.mp4.part"));
    EXPECT_SAID("5 of 5 frames of the film");
    // A film cannot be written where there is no folder; ffmpeg's words are passed on.
    const Expected<bool> nowhere =
        writeFilm(*ffmpeg, (folder_ / "none" / "wall.mp4").string(), layout, images, *signals, console());
    EXPECT_FALSE(nowhere);
    EXPECT_SAID("ffmpeg: ");
}

}  // namespace
}  // namespace tessera
