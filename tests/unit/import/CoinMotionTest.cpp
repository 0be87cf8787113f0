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
    void expectNote(const std::string& note) const {
        EXPECT_NE(notes_.find(note), std::string::npos) << note << " in\n" << notes_;
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
    expectNote("fieldOfView of a Viewpoint stands still: it cannot be animated here (the first: 'V')");
}

TEST_F(CoinMotions, FieldsThatStandStillAreNamed) {
    const std::string box = "Shape { geometry Box {} }\n";
    const auto expectStill = [&](const std::string& node, const std::string& kind, const std::string& values,
                                 const std::string& field, const std::string& word) {
        read(box + "DEF X " + node + kClock + movedBy("I", kind, values, "X." + field));
        expectNote(fmt::format("{} of a {} stands still: it cannot be animated here (the first: 'X')", field, word));
        EXPECT_TRUE(all<KeyFrames>().empty());
    };
    expectStill("Billboard { " + kBoxInIt, "Position", "0 1 0, 1 0 0", "axisOfRotation", "Billboard");
    expectStill("Background { skyColor [ 0 0 1 ] }", "Color", "0 0 0, 1 0 0", "skyColor", "Background");
    expectStill("LOD { range 5 level [ Group {} Group {} ] }", "Position", "0 0 0, 1 0 0", "center", "LOD");
    expectStill("PointLight {}", "Position", "0 0 0, 1 0 0", "location", "PointLight");
    // A node that is left out altogether has that note alone.
    read(box + "DEF X Fog {}" + kClock + movedBy("I", "Scalar", "0 1", "X.visibilityRange"));
    EXPECT_EQ(notes_.find("visibilityRange"), std::string::npos);
    // Coin drops a route between fields of different types.
    read(
        "Shape { appearance Appearance { material Material {} texture PixelTexture { image 1 1 3 0xff0000 } "
        "textureTransform DEF X TextureTransform {} } geometry Box {} }" +
        kClock + movedBy("I", "Position", "0 0 0, 1 0 0", "X.translation"));
    expectNote("an interpolator moves nothing: no field of a known node takes its values (the first: 'I')");
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
    expectNote("an interpolator moves nothing: no field of a known node takes its values (the first: 'I')");
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
        expectNote("1 of its animations wait for an event or a time: they stand until somebody plays them");
    }
    EXPECT_TRUE(plays("stopTime 9e9"));
    expectNote("an animation goes on after its stopTime (the first: 'T')");
}

}  // namespace
}  // namespace tessera
