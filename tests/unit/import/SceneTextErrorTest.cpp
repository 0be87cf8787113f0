// Tessera's own text format: what it says when it is wrong.
#include <ostream>

#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

/// The error of a scene text, the scratch folder's name cut off.
std::string errorOf(const std::string& text) {
    const Scratch scratch;
    const Expected<ImportedScene> scene = importScene(scratch.write("scene.tsct", text), kRootNode, importOptions());
    if (scene) return "(imported)";
    const std::size_t at = scene.error().message.find("scene.tsct");
    return at == std::string::npos ? scene.error().message : scene.error().message.substr(at);
}

struct WrongText {
    const char* name;
    const char* text;
    const char* message;
};
void PrintTo(const WrongText& wrong, std::ostream* out) {
    *out << wrong.name;
}

class SceneTextError : public testing::TestWithParam<WrongText> {};

TEST_P(SceneTextError, NamesLineColumnAndReason) {
    EXPECT_EQ(errorOf(GetParam().text), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    Of, SceneTextError,
    testing::Values(
        WrongText{"UnknownKey", "node {\n  nam: \"x\"\n}", "scene.tsct:2:6: Node has no 'nam'; did you mean 'name'?"},
        WrongText{"UnknownShape", "node { boxes { } }", "scene.tsct:1:14: Node has no 'boxes'; did you mean 'box'?"},
        WrongText{"MissingBrace", "node { name: \"x\"",
                  "scene.tsct:1:17: the file ends here, and the '{' of node in line 1 is not closed"},
        WrongText{"BraceOfAnotherLine", "node {\n  transform { translation { x: 1 }\n  node { } }\n",
                  "scene.tsct:3:8: Transform has no 'node'; is the '{' of transform in line 2 closed?"},
        WrongText{"UnknownWord", "node {\n  interest { object: \"a\" response: STPO\n} }",
                  "scene.tsct:3:1: response cannot be STPO; did you mean 'STOP'? (it can be REPORT, STOP, SLIDE, "
                  "BOUNCE, ROLLBACK, ASK)"},
        WrongText{"UnknownMaterial",
                  "material { name: \"brass\" }\nnode { material: \"bras\" box { size { x: 1 y: 1 z: 1 } } }",
                  "scene.tsct:2:8: there is no material 'bras'; did you mean 'brass'?"},
        WrongText{"UnknownDefinition", "node { instance: \"wheel\" }",
                  "scene.tsct:1:1: there is no definition 'wheel'"},
        WrongText{"UnknownTarget", "node {\n  motion { target: \"crane\" key {} } }",
                  "scene.tsct:2:3: there is no node 'crane' for this motion to move"},
        WrongText{"TargetWithoutTransform", "node { name: \"a\" }\nnode { motion { target: \"a\" key {} } }",
                  "scene.tsct:2:8: the motion's target 'a' has no transform"},
        WrongText{"UnknownInterest", "node { interest { object: \"x\" } }",
                  "scene.tsct:1:8: there is no node 'x' for this interest"},
        WrongText{"InterestWithoutObject", "node {\n  interest { against: \"x\" } }",
                  "scene.tsct:2:3: this interest names no object"},
        WrongText{"InterestInTheTop", "node { interest { object: \"/\" } }",
                  "scene.tsct:1:8: '/' is the top of the file, and no node; name one below it"},
        WrongText{"ObjectIsTheTop", "node {\n collision_object { node: \"/\" } }",
                  "scene.tsct:2:2: '/' is the top of the file, and no node; name one below it"},
        WrongText{"LightAtTheTop", "node { point_light { beacon: \"/\" } }",
                  "scene.tsct:1:1: '/' is the top of the file, and no node; name one below it"},
        WrongText{"HandlesOfTheTop", "node { manipulator { target: \"/\" } }",
                  "scene.tsct:1:1: '/' is the top of the file, and no node; name one below it"},
        WrongText{"UnknownResponse", "node { interest {\n object: \"x\" response: SLIP } }",
                  "scene.tsct:2:29: response cannot be SLIP; did you mean 'STOP'? (it can be REPORT, STOP, SLIDE, "
                  "BOUNCE, ROLLBACK, ASK)"},
        WrongText{"ResponseBeyondAll", "node { name: \"x\" }\nnode { interest { object: \"x\" response: 17 } }",
                  "scene.tsct:2:8: an interest: response must be between 0 and 5, not 17"},
        WrongText{"ModeBeyondAll", "node { name: \"x\" transform {} motion { mode: 3 key { time: 0 } } }",
                  "scene.tsct:1:1: node 'x': a motion's mode is 3, which is none of its words"},
        WrongText{
            "SpotTooWide", "node { name: \"x\" spot_light { outer_angle_deg: -1 } }",
            "scene.tsct:1:1: node 'x': outerAngle must be between 0 and 1.5707963705062866, not -0.01745329238474369"},
        WrongText{"SpotOfNegativeRange", "node { name: \"x\" spot_light { range: -1 } }",
                  "scene.tsct:1:1: node 'x': range must be at least 0, not -1"},
        WrongText{"NegativeThreshold", "node { name: \"x\" }\nnode { interest { object: \"x\" threshold: -1 } }",
                  "scene.tsct:2:8: an interest: threshold must be between 0 and 1000000000000, not -1"},
        WrongText{"FacesOrNone",
                  "node { name: \"x\" }\nnode { interest { object: \"x\" yes_or_no: true most_faces: 3 } }",
                  "scene.tsct:2:8: an interest: yes_or_no lists no faces, most_faces some; which is it?"},
        WrongText{"TooManyFaces", "node { name: \"x\" }\nnode { interest { object: \"x\" most_faces: 1000001 } }",
                  "scene.tsct:2:8: an interest: most_faces must be between 0 and 1000000, not 1000001"},
        WrongText{"EndlessPatience", "node { name: \"x\" }\nnode { interest { object: \"x\" patience: 2000000 } }",
                  "scene.tsct:2:8: an interest: patience must be between 0 and 1000000, not 2000000"},
        WrongText{"NegativeMass", "node { transform {}\n  collision_object { mass: -2 } }",
                  "scene.tsct:2:3: a collision object: mass must be between 0 and 1000000000000, not -2"},
        WrongText{"TooFine", "node { transform {} collision_object { level: 13 } }",
                  "scene.tsct:1:21: a collision object: level must be between 0 and 12, not 13"},
        WrongText{"TooWrong", "node { transform {} collision_object { error: 20.5 } }",
                  "scene.tsct:1:21: a collision object: error must be between 0 and 20, not 20.5"},
        WrongText{"TooBouncy", "node { transform {} collision_object { restitution: 1.5 } }",
                  "scene.tsct:1:21: a collision object: restitution must be between 0 and 1, not 1.5"},
        WrongText{"NegativeFriction", "node { transform {} collision_object { friction: -0.1 } }",
                  "scene.tsct:1:21: a collision object: friction must be between 0 and 1000, not -0.1"},
        WrongText{"TooFast", "node { transform {} collision_object { velocity { y: -2e6 } } }",
                  "scene.tsct:1:21: a collision object: velocity must be between -1000000 and 1000000, not -2000000"},
        WrongText{"SpinIsNoNumber", "node { transform {} collision_object { spin { z: nan } } }",
                  "scene.tsct:1:21: a collision object: spin is not a finite number"},
        WrongText{"UnknownCollisionNode", "node {\n  transform {}\n  collision_object { node: \"bolt\" } }",
                  "scene.tsct:3:3: there is no node 'bolt' for this collision object"},
        WrongText{"CollisionObjectOfNothing", "node { name: \"a\" node { collision_object {} } }",
                  "scene.tsct:1:25: this collision object has no transform at or above it; name its node"},
        WrongText{"UnknownCollisionField", "node { collision_object { weight: 3 } }",
                  "scene.tsct:1:33: CollisionObject has no 'weight'"},
        WrongText{"GravityBeyondBounds", "node { environment { gravity { y: -1e7 } } }",
                  "scene.tsct:1:1: node 'environment': gravity's x, y and z must be between -1000000 and 1000000"},
        WrongText{"FlatBox", "node { name: \"b\" box { size { x: 1 y: 1 } } }",
                  "scene.tsct:1:1: a box's size x, y and z must be above zero and below 1e9"},
        WrongText{"PointsNowhere", "node { name: \"p\" points { radius: 1 } }",
                  "scene.tsct:1:1: points need a list of them, or a surface"},
        WrongText{"PointsTwice", "node { points { point {} spacing: 1 sphere { radius: 1 } } }",
                  "scene.tsct:1:1: points are either listed or on a surface"},
        WrongText{"PointsWithoutSpacing", "node { points { sphere { radius: 1 } } }",
                  "scene.tsct:1:1: the spacing of points on a surface must be above zero and below 1e9"},
        WrongText{"PointsOnNothing", "node { points { spacing: 1 sphere { } } }",
                  "scene.tsct:1:1: a sphere's radius must be above zero and below 1e9"},
        WrongText{"PointsTooDense", "node { points { spacing: 0.0001 box { size { x: 1 y: 1 z: 1 } } } }",
                  "scene.tsct:1:1: 600000000 points, at most 8000000 are allowed"},
        WrongText{"PointsOfNegativeRadius", "node { points { radius: -1 point {} } }",
                  "scene.tsct:1:1: the radius of points must not be negative"},
        WrongText{"PointsWithIndex",
                  "mesh { name: \"m\" primitive: POINTS position: [0,0,0] index: [0,0,0] }\nnode { }",
                  "scene.tsct:1:1: mesh 'm': points have no index"},
        WrongText{"Nan", "node { name: \"n\" transform { translation { x: nan } } }",
                  "scene.tsct:1:1: node 'n': a transform holds a number that is not finite or beyond 1e15"},
        WrongText{"DoubleMaterial", "material { name: \"m\" }\nmaterial { name: \"m\" }\nnode { }",
                  "scene.tsct:2:1: the material 'm' is there twice"},
        WrongText{"IndexOutOfRange", "mesh { name: \"m\" position: [0,0,0] index: [0,1,0] }\nnode { }",
                  "scene.tsct:1:1: mesh 'm': index 1 of 1 vertices"},
        WrongText{"DescendingKeys", "node { name: \"n\" transform {} motion { key { time: 1 } key { time: 1 } } }",
                  "scene.tsct:1:1: node 'n': a motion's times do not ascend from 0"},
        WrongText{"FromTheFuture", "version: 7",
                  "scene.tsct: it is a scene of version 7; this program reads version 1"},
        WrongText{"Nothing", "# only a comment\n", "scene.tsct: there is nothing in it to show"},
        WrongText{"Garbage", "\x01\x02\xff not a scene",
                  "scene.tsct:1:1: Invalid control characters encountered in text"},
        WrongText{"ImportOutside", "node { import { uri: \"../../etc/passwd\" } }",
                  "scene.tsct:1:8: '../../etc/passwd' leads out of the file's own folder"},
        WrongText{"AssetOutside", "node { import { uri: \"asset://../../../etc/passwd\" } }",
                  "scene.tsct:1:8: asset '../../../etc/passwd' leads out of the asset folders"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace tessera
