// VRML: fields that interpolators move, those that stand still with a note, and animations that play by themselves.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/cores/Animation.h"
#include "common/cores/Camera.h"
#include "common/cores/Transform.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

const std::string kMotionHead = "#VRML V2.0 utf8\n";
const std::string kClock = "DEF T TimeSensor { cycleInterval 10 loop TRUE }\n";
const std::string kBoxInIt = "children Shape { geometry Box {} } }\n";

class CoinMotions : public testing::Test {
protected:
    void read(const std::string& text) {
        Expected<ImportedScene> scene =
            importScene(scratch_.write("a.wrl", kMotionHead + text), kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        notes_ = fmt::format("{}", fmt::join(scene->notes, "\n"));
        aspect_.emplace(std::move(*scene));
    }
    template <typename Core>
    [[nodiscard]] std::vector<const Core*> all() const {
        std::vector<const Core*> found;
        for (const ObjectId id : (**aspect_).ids())
            if (const auto* core = (**aspect_).template get<Core>(id)) found.push_back(core);
        return found;
    }

    const Scratch scratch_;
    std::optional<ImportedAspect> aspect_;
    std::string notes_;
};

std::string movedBy(const std::string& name, const std::string& kind, const std::string& values,
                    const std::string& to) {
    return fmt::format(
        "DEF {0} {1}Interpolator {{ key [ 0 1 ] keyValue [ {2} ] }}\nROUTE T.fraction_changed TO {0}.set_fraction\n"
        "ROUTE {0}.value_changed TO {3}\n",
        name, kind, values, to);
}

TEST_F(CoinMotions, ViewpointsMove) {
    const std::string moves = kClock + movedBy("P", "Position", "0 0 9, 5 0 9", "V.position") +
                              movedBy("O", "Orientation", "0 1 0 0, 0 1 0 1", "V.set_orientation");
    const std::string view = "DEF V Viewpoint { position 0 1 9 orientation 0 1 0 1 }";
    read("Shape { geometry Box {} }\n" + view + moves);
    EXPECT_EQ(notes_, "");
    const auto* place = aspect_->core<Transform>("/a/V");
    ASSERT_NE(place, nullptr);
    EXPECT_EQ(place->translation, Vec3d(0, 1, 9)) << "as the file has it at rest";
    ASSERT_EQ(all<Camera>().size(), 1u);
    std::map<std::string, const KeyFrames*> channels;
    for (const KeyFrames* one : all<KeyFrames>()) channels[one->field] = one;
    ASSERT_EQ(channels.size(), 2u);
    ASSERT_TRUE(channels.contains("translation") && channels.contains("rotation"));
    EXPECT_EQ((**aspect_).get<Transform>(channels["translation"]->target), place);
    EXPECT_EQ(channels["translation"]->values.as<double>()[3], 5);
    // The Transform above it stays.
    read("Shape { geometry Box {} } Transform { translation 3 0 0 children " + view + " }" + moves);
    EXPECT_EQ(aspect_->core<Transform>("/a/Transform")->translation, Vec3d(3, 0, 0));
    EXPECT_EQ(aspect_->core<Transform>("/a/Transform/V")->translation, Vec3d(0, 1, 9));
    read("Shape { geometry Box {} }\nDEF V Viewpoint {}" + kClock +
         movedBy("S", "Scalar", "0.5 1", "V.set_fieldOfView"));
    EXPECT_WORDS(notes_);
}

TEST_F(CoinMotions, FieldsThatStandStillAreNamed) {
    const std::string box = "Shape { geometry Box {} }\n";
    const auto expectStill = [&](const std::string& node, const std::string& kind, const std::string& values,
                                 const std::string& field) {
        read(box + "DEF X " + node + kClock + movedBy("I", kind, values, "X." + field));
        EXPECT_WORDS(notes_);
        EXPECT_TRUE(all<KeyFrames>().empty());
    };
    expectStill("Billboard { " + kBoxInIt, "Position", "0 1 0, 1 0 0", "axisOfRotation");
    expectStill("Background { skyColor [ 0 0 1 ] }", "Color", "0 0 0, 1 0 0", "skyColor");
    expectStill("LOD { range 5 level [ Group {} Group {} ] }", "Position", "0 0 0, 1 0 0", "center");
    expectStill("PointLight {}", "Position", "0 0 0, 1 0 0", "location");
    // A node that is left out altogether has that note alone.
    read(box + "DEF X Fog {}" + kClock + movedBy("I", "Scalar", "0 1", "X.visibilityRange"));
    EXPECT_EQ(notes_.find("visibilityRange"), std::string::npos);
    // Coin drops a route between fields of different types.
    read(
        "Shape { appearance Appearance { material Material {} texture PixelTexture { image 1 1 3 0xff0000 } "
        "textureTransform DEF X TextureTransform {} } geometry Box {} }" +
        kClock + movedBy("I", "Position", "0 0 0, 1 0 0", "X.translation"));
    EXPECT_WORDS(notes_);
}

TEST_F(CoinMotions, RoutesWithinPrototypesAreFollowedOrNamed) {
    const std::string clock = "DEF T TimeSensor { cycleInterval 2 loop TRUE }\n";
    const std::string inner =
        "PROTO Inner [ eventIn SFFloat f exposedField SFVec3f pos 0 0 0 ] { Group { children [ DEF X Transform { "
        "translation IS pos " +
        kBoxInIt + clock +
        "DEF P PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 1 0 0 ] set_fraction IS f } ] }\n"
        "ROUTE T.fraction_changed TO P.set_fraction ROUTE P.value_changed TO X.set_translation }\n";
    read(inner + "Inner {} Inner {}");
    EXPECT_EQ(notes_, "") << "a route counts beside an IS";
    EXPECT_EQ(all<KeyFrames>().size(), 2u);
    read("PROTO Inner [ exposedField SFVec3f pos 0 0 0 ] { Transform { translation IS pos " + kBoxInIt + "}\n" +
         "PROTO Outer [] { Group { children [ DEF IN Inner { pos 3 3 3 } ] }\n" + clock +
         movedBy("I", "Position", "0 0 0, 1 0 0", "IN.pos") + "}\nOuter {}");
    EXPECT_WORDS(notes_);
    // One to an instance at the top is followed.
    read("PROTO Inner [ exposedField SFVec3f pos 0 0 0 ] { Transform { translation IS pos " + kBoxInIt +
         "}\nDEF IN Inner {}" + clock + movedBy("I", "Position", "0 0 0, 1 0 0", "IN.pos"));
    EXPECT_EQ(notes_, "");
    EXPECT_EQ(all<KeyFrames>().size(), 1u);
}

TEST_F(CoinMotions, TimeSensorsRunAsTheirTimesSay) {
    const auto plays = [&](const std::string& times) {
        read("DEF B Transform { " + kBoxInIt + "DEF T TimeSensor { loop TRUE " + times + " }\n" +
             movedBy("I", "Position", "0 0 0, 1 0 0", "B.translation"));
        const auto animations = all<Animation>();
        return animations.size() == 1 && animations[0]->playing;
    };
    EXPECT_TRUE(plays(""));
    EXPECT_TRUE(plays("startTime 1 stopTime 1")) << "a stopTime that is not behind startTime is none";
    EXPECT_EQ(notes_, "");
    for (const char* times : {"startTime 1 stopTime 2", "startTime 9e9", "enabled FALSE"}) {
        EXPECT_FALSE(plays(times)) << times;
        EXPECT_WORDS(notes_);
    }
    EXPECT_TRUE(plays("stopTime 9e9"));
    EXPECT_WORDS(notes_);
}

TEST_F(CoinMotions, MotionThatIsLostIsNamed) {
    const std::string here = scratch_.path("a.wrl") + ": ";
    const std::string boxes =
        "DEF B Transform { " + kBoxInIt + "DEF U Transform { translation 4 0 0 " + kBoxInIt + kClock;
    read(boxes + "DEF D TimeSensor { cycleInterval 5 loop TRUE }\n" +
         movedBy("I", "Position", "0 0 0, 3 0 0", "B.set_translation") +
         "ROUTE D.fraction_changed TO I.set_fraction ROUTE I.value_changed TO U.set_translation");
    EXPECT_EQ(notes_, here + "of several TimeSensors that drive one interpolator the last one does (the first: 'I')");
    ASSERT_EQ(all<KeyFrames>().size(), 2u);
    for (const KeyFrames* one : all<KeyFrames>()) EXPECT_EQ(one->times.as<double>().back(), 5);
    read(boxes + movedBy("I", "Position", "0 0 0, 3 0 0", "B.set_translation") +
         "ROUTE B.translation_changed TO U.set_translation");
    EXPECT_EQ(notes_,
              here +
                  "translation of a Transform stands still: a route from another node's field is not followed (the "
                  "first: 'U')");
    EXPECT_EQ(aspect_->core<Transform>("/a/U")->translation, Vec3d(4, 0, 0)) << "as the file has it";
    // Nothing comes of a field that stands still.
    read(boxes + "ROUTE B.translation_changed TO U.set_translation");
    EXPECT_EQ(notes_, "");
    read(boxes + "DEF I PositionInterpolator { key [ 0 0.5 1 ] keyValue [ 0 0 0, 3 0 0 ] }\n" +
         "ROUTE T.fraction_changed TO I.set_fraction ROUTE I.value_changed TO B.translation "
         "ROUTE I.value_changed TO U.translation");
    EXPECT_EQ(notes_,
              here +
                  "an interpolator has not as many values as keys: what has no partner does not count (the first: "
                  "'I')");
}

TEST_F(CoinMotions, CyclesWithoutBoundsAreCalledThat) {
    const std::string here = scratch_.path("a.wrl") + ": ";
    const auto noteOf = [&](const char* cycle) {
        read(fmt::format("DEF B Transform {{ {}DEF T TimeSensor {{ loop TRUE cycleInterval {} }}\n", kBoxInIt, cycle) +
             movedBy("I", "Position", "0 0 0, 1 0 0", "B.translation"));
        return notes_;
    };
    EXPECT_EQ(noteOf("1e30"),
              here + "an interpolator moves nothing: its TimeSensor has a cycle beyond 1e9 s (the first: 'I')");
    EXPECT_EQ(noteOf("-5"),
              here + "an interpolator moves nothing: its TimeSensor has no cycle of more than 0 s (the first: 'I')");
    EXPECT_EQ(noteOf("1e9"), "");
}

TEST_F(CoinMotions, KeysOfOneTimeAreAJumpWithinTheCycle) {
    const auto keysOf = [&](const std::string& keys, const std::string& values) {
        read("DEF B Transform { " + kBoxInIt + "DEF T TimeSensor { cycleInterval 4 loop TRUE }\n" +
             fmt::format("DEF I PositionInterpolator {{ key [ {} ] keyValue [ {} ] }}\n", keys, values) +
             "ROUTE T.fraction_changed TO I.set_fraction ROUTE I.value_changed TO B.translation");
        const auto frames = all<KeyFrames>();
        EXPECT_EQ(frames.size(), 1u);
        std::vector<std::pair<double, double>> found;  // a time, and x then
        for (std::size_t i = 0; frames.size() == 1 && i < frames[0]->times.as<double>().size(); ++i)
            found.emplace_back(frames[0]->times.as<double>()[i], frames[0]->values.as<double>()[3 * i]);
        return found;
    };
    using Keys = std::vector<std::pair<double, double>>;
    const double jump = 4e-6;
    EXPECT_EQ(keysOf("0 0 0 0.5 0.5 1 1 1", "0 0 0, 1 0 0, 2 0 0, 3 0 0, 4 0 0, 5 0 0, 6 0 0, 7 0 0"),
              (Keys{{0, 2}, {2, 3}, {4 * (0.5 + 1e-6), 4}, {4 * (1 - 1e-6), 5}, {4, 7}}));
    std::string keys, values;
    for (int i = 0; i < 20'000; ++i) {
        keys += "0.5 ";
        values += fmt::format("{} 0 0,", i);
    }
    const Keys many = keysOf("0 " + keys + "1", "7 0 0," + values + "8 0 0");
    ASSERT_EQ(many.size(), 4u);
    EXPECT_EQ(many[1], std::pair(2.0, 0.0));
    EXPECT_NEAR(many[2].first, 2 + jump, 1e-12);
    EXPECT_EQ(many[2].second, 19'999);
    // Keys that lie close are no jump, and stay where they are.
    const Keys close = keysOf("0 0.5 0.50000006 0.50000012 1", "0 0 0, 1 0 0, 2 0 0, 3 0 0, 4 0 0");
    ASSERT_EQ(close.size(), 5u);
    EXPECT_NEAR(close[3].first, 2.0000005, 1e-7);
}

}  // namespace
}  // namespace tessera
