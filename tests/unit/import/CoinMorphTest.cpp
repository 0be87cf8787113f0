// Interpolators of coordinates, as morph targets; and levels that Inventor chooses by area.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "common/cores/Animation.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Geometry.h"
#include "common/cores/Skin.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

const std::string kMorphHead = "#VRML V2.0 utf8\n";

using PointList = std::vector<Vec3d>;

/// As ISO/IEC 14772-1:1997, 4.6.8, has it.
Vec3d vrmlInterpolated(const std::vector<double>& keys, const std::vector<PointList>& values, std::size_t point,
                       double t) {
    if (t <= keys.front()) return values.front()[point];
    if (t >= keys.back()) return values.back()[point];
    std::size_t k = 0;
    while (!(t < keys[k + 1])) ++k;
    const double share = (t - keys[k]) / (keys[k + 1] - keys[k]);
    return values[k][point] + share * (values[k + 1][point] - values[k][point]);
}

std::string pointText(const PointList& points) {
    std::string text;
    for (const Vec3d& p : points) text += fmt::format("{} {} {}, ", p.x(), p.y(), p.z());
    return text;
}

class CoinMorphFiles : public testing::Test {
protected:
    void read(const std::string& name, const std::string& text) {
        Expected<ImportedScene> scene = importScene(scratch_.write(name, text), kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        notes_ = fmt::format("{}", fmt::join(scene->notes, "\n"));
        aspect_.emplace(std::move(*scene));
        skins_.clear();
        channels_.clear();
        for (const ObjectId id : (**aspect_).ids()) {
            if (const auto* skin = (**aspect_).get<Skin>(id)) skins_.push_back(skin);
            if (const auto* frames = (**aspect_).get<KeyFrames>(id); frames && frames->field == "weights")
                channels_.push_back(frames);
        }
    }
    /// Those of the first channel.
    [[nodiscard]] std::vector<double> weightsAt(double time) const {
        const auto times = channels_.at(0)->times.as<double>(), values = channels_[0]->values.as<double>();
        const std::size_t width = values.size() / times.size();
        std::size_t k = 0;
        while (k + 2 < times.size() && time >= times[k + 1]) ++k;
        const double share = std::clamp((time - times[k]) / (times[k + 1] - times[k]), 0.0, 1.0);
        std::vector<double> weights;
        for (std::size_t w = 0; w < width; ++w)
            weights.push_back((1 - share) * values[k * width + w] + share * values[(k + 1) * width + w]);
        return weights;
    }
    /// What a host makes of it.
    [[nodiscard]] static Vec3d vertexOf(const Blob& at, const Blob& targets, std::span<const double> weights,
                                        std::size_t vertex) {
        const auto rest = at.as<float>(), ways = targets.as<float>();
        Vec3d place(rest[3 * vertex], rest[3 * vertex + 1], rest[3 * vertex + 2]);
        for (std::size_t t = 0; t < weights.size(); ++t)
            for (Eigen::Index c = 0; c < 3; ++c)
                place[c] += weights[t] * ways[t * rest.size() + 3 * vertex + static_cast<std::size_t>(c)];
        return place;
    }
    /// Each corner of each triangle, in all places of the file's keys and between, beside the formula.
    void expectAsInterpolated(const PointList& rest, const std::vector<double>& keys,
                              const std::vector<PointList>& values, double cycle) {
        ASSERT_EQ(skins_.size(), 1u);
        const Skin& skin = *skins_[0];
        const auto positions = skin.positions.as<float>();
        for (int step = 0; step <= 40; ++step) {
            // Not at the keys themselves: a jump is there.
            const double fraction = (step + 0.37) / 41.0;
            const std::vector<double> weights = weightsAt(fraction * cycle);
            ASSERT_EQ(skin.morphPositions.as<float>().size(), weights.size() * positions.size());
            for (std::size_t v = 0; 3 * v < positions.size(); ++v) {
                const Vec3d at(positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]);
                const auto point = std::ranges::find(rest, at);
                ASSERT_NE(point, rest.end());
                const auto number = static_cast<std::size_t>(point - rest.begin());
                EXPECT_LT((vertexOf(skin.positions, skin.morphPositions, weights, v) -
                           vrmlInterpolated(keys, values, number, fraction))
                              .norm(),
                          1e-5)
                    << "point " << number << " at " << fraction;
            }
        }
    }
    static std::string file(const std::string& geometry, const PointList& rest, const std::vector<double>& keys,
                            const std::vector<PointList>& values, const std::string& coordinate = "C") {
        std::string all;
        for (const PointList& each : values) all += pointText(each);
        return fmt::format(
            "{}Shape {{ geometry {} }}\nDEF T TimeSensor {{ loop TRUE cycleInterval 4 }} DEF I CoordinateInterpolator "
            "{{ key [ {} ] keyValue [ {} ] }}\nROUTE T.fraction_changed TO I.set_fraction ROUTE I.value_changed TO "
            "{}.set_point",
            kMorphHead, fmt::format(fmt::runtime(geometry), pointText(rest)), fmt::join(keys, " "), all, coordinate);
    }

    const Scratch scratch_;
    std::optional<ImportedAspect> aspect_;
    std::string notes_;
    std::vector<const Skin*> skins_;
    std::vector<const KeyFrames*> channels_;
};

const PointList kSixPoints = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
const std::string kTwoQuadFaces =
    "IndexedFaceSet {{ solid FALSE creaseAngle 1 coord DEF C Coordinate {{ point [ {} ] }} coordIndex [ 0 1 4 3 -1 1 2 "
    "5 4 -1 ] }}";

PointList waved(const PointList& from, double up, double wave) {
    PointList to = from;
    for (Vec3d& p : to) p.z() += up + wave * p.x();
    return to;
}

TEST_F(CoinMorphFiles, PutPointsWhereTheInterpolatorDoes) {
    const std::vector<double> keys = {0.1, 0.25, 0.5, 0.5, 1};
    // Two keys of one time are a jump; the last one is as at rest.
    const std::vector<PointList> values = {waved(kSixPoints, 1, 0), waved(kSixPoints, 0, 3), waved(kSixPoints, -2, 1),
                                           waved(kSixPoints, 5, 0), kSixPoints};
    read("a.wrl", file(kTwoQuadFaces, kSixPoints, keys, values));
    EXPECT_EQ(notes_, "");
    ASSERT_EQ(channels_.size(), 1u);
    expectAsInterpolated(kSixPoints, keys, values, 4);
    EXPECT_EQ(weightsAt(0).size(), 4u) << "at rest nothing is added";
    EXPECT_EQ(skins_[0]->positions.sizeBytes(), 6u * 12) << "corners that are alike at all keys are one";
    for (const float weight : skins_[0]->weights.as<float>()) EXPECT_EQ(weight, 0);
}

TEST_F(CoinMorphFiles, JoinCornersOnlyWhereTheyAreAlikeAtAllKeys) {
    // Flat at rest, with a sharp edge in the middle at the one key.
    PointList folded = kSixPoints;
    folded[2].x() = folded[5].x() = 1;
    folded[2].z() = folded[5].z() = 1;
    read("a.wrl", file(kTwoQuadFaces, kSixPoints, {0.5}, {folded}));
    EXPECT_EQ(notes_, "");
    ASSERT_EQ(skins_.size(), 1u);
    const Skin& skin = *skins_[0];
    EXPECT_EQ(skin.positions.sizeBytes(), 8u * 12);
    ASSERT_EQ(skin.morphNormals.sizeBytes(), skin.normals.sizeBytes());
    std::set<std::string> there;
    for (std::size_t v = 0; v < 8; ++v) {
        const Vec3d normal = vertexOf(skin.normals, skin.morphNormals, std::array{1.0}, v);
        EXPECT_NEAR(normal.norm(), 1, 1e-5);
        there.insert(fmt::format("{:.0f} {:.0f}", std::abs(normal.x()), std::abs(normal.z())));
    }
    EXPECT_EQ(there, (std::set<std::string>{"0 1", "1 0"}));
}

TEST_F(CoinMorphFiles, KeepPolygonsColoursAndNormalsOfTheFile) {
    const PointList rest = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 1, 0}, {0, 4, 0}};
    const std::vector<PointList> values = {rest, waved(rest, 0, 1)};
    // Concave, of the other side, with normals of its own and colours of corners.
    read("a.wrl",
         file("IndexedFaceSet {{ convex FALSE ccw FALSE normalPerVertex FALSE normal Normal {{ vector [ 0 0 -2 ] }} "
              "color Color {{ color [ 1 0 0, 0 1 0 ] }} colorIndex [ 0 1 0 1 0 -1 ] coord DEF C Coordinate {{ point [ "
              "{} ] }} coordIndex [ 0 1 2 3 4 -1 ] }}",
              rest, {0, 1}, values));
    EXPECT_EQ(notes_, "");
    expectAsInterpolated(rest, {0, 1}, values, 4);
    const Skin& skin = *skins_[0];
    EXPECT_EQ(skin.indices.sizeBytes(), 9u * 4);
    EXPECT_EQ(skin.colors.sizeBytes(), 5u * 4);
    EXPECT_TRUE(skin.morphNormals.empty());
    for (std::size_t v = 0; v < 5; ++v) EXPECT_EQ(skin.normals.as<float>()[3 * v + 2], -1);
    const auto corner = [&](std::size_t i) {
        const std::size_t v = skin.indices.as<std::uint32_t>()[i];
        return vertexOf(skin.positions, skin.morphPositions, {}, v);
    };
    EXPECT_LT(Vec3d((corner(1) - corner(0)).cross(corner(2) - corner(0))).z(), 0) << "seen from below";
}

TEST_F(CoinMorphFiles, MoveWhatIsNothingAtRestAndWhatOnlyKeysSay) {
    const std::vector<PointList> values = {PointList(6, Vec3d::Zero()), kSixPoints};
    read("a.wrl", file(kTwoQuadFaces, PointList(6, Vec3d::Zero()), {0, 1}, values));
    EXPECT_EQ(notes_, "");
    ASSERT_EQ(skins_.size(), 1u);
    EXPECT_EQ(skins_[0]->indices.sizeBytes(), 12u * 4);
    read("b.wrl", file(kTwoQuadFaces, {}, {0, 1}, {kSixPoints, waved(kSixPoints, 1, 1)}));
    EXPECT_EQ(notes_, "");
    expectAsInterpolated(kSixPoints, {0, 1}, {kSixPoints, waved(kSixPoints, 1, 1)}, 4);
}

TEST_F(CoinMorphFiles, MoveEachUseAndAllOfX3d) {
    const std::string use =
        "Transform { translation 5 0 0 children DEF S Shape { geometry IndexedFaceSet { coord DEF C Coordinate { point "
        "[ 0 0 0, 1 0 0, 0 1 0 ] } coordIndex [ 0 1 2 ] } } }\nUSE S\nDEF T TimeSensor { loop TRUE } DEF I "
        "CoordinateInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 1 0 0, 0 1 0, 0 0 1, 1 0 1, 0 1 1 ] }\n"
        "ROUTE T.fraction_changed TO I.set_fraction ROUTE I.value_changed TO C.point";
    read("a.wrl", kMorphHead + use);
    EXPECT_EQ(notes_, "");
    EXPECT_EQ(skins_.size(), 2u);
    EXPECT_EQ(channels_.size(), 2u);
    read("b.x3d",
         "<X3D><Scene><Shape><IndexedTriangleSet index='0 1 2'><Coordinate DEF='C' point='0 0 0 1 0 0 0 1 0'/>"
         "</IndexedTriangleSet></Shape><TimeSensor DEF='T' loop='true'/><CoordinateInterpolator DEF='I' key='0 1' "
         "keyValue='0 0 0 1 0 0 0 1 0 0 0 1 1 0 1 0 1 1'/><ROUTE fromNode='T' fromField='fraction_changed' toNode='I' "
         "toField='set_fraction'/><ROUTE fromNode='I' fromField='value_changed' toNode='C' toField='set_point'/>"
         "</Scene></X3D>");
    EXPECT_EQ(notes_, "");
    ASSERT_EQ(skins_.size(), 1u);
    EXPECT_EQ(skins_[0]->morphPositions.sizeBytes(), 3u * 12);
    // Through the interface of a prototype, which has no points itself.
    read("c.wrl", kMorphHead +
                      "PROTO P [ exposedField MFVec3f p [ 0 0 0 ] ] { Shape { geometry IndexedFaceSet { coord "
                      "Coordinate { point IS p } coordIndex [ 0 1 2 ] } } }\nDEF Q P {} DEF T TimeSensor { loop TRUE } "
                      "DEF I CoordinateInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 1 0 0, 0 1 0, 0 0 1, 1 0 1, 0 1 1 "
                      "] }\nROUTE T.fraction_changed TO I.set_fraction ROUTE I.value_changed TO Q.p");
    EXPECT_EQ(notes_, "");
    ASSERT_EQ(skins_.size(), 1u);
    EXPECT_EQ(skins_[0]->morphPositions.sizeBytes(), 3u * 12) << "at rest as at the first key";
}

TEST_F(CoinMorphFiles, SayWhatStandsStill) {
    const auto notes = [&](const std::string& geometry, const std::string& interpolator) {
        read("a.wrl", kMorphHead + "Shape { geometry " + geometry +
                          " } Shape { geometry Box {} } DEF T TimeSensor {} DEF I CoordinateInterpolator { " +
                          interpolator +
                          " } ROUTE T.fraction_changed TO I.set_fraction ROUTE I.value_changed TO C.point");
        EXPECT_TRUE(skins_.empty());
        return notes_;
    };
    const std::string faces =
        "IndexedFaceSet { coordIndex [ 0 1 2 ] coord DEF C Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } }";
    EXPECT_WORDS(
        notes("PointSet { coord DEF C Coordinate { point [ 0 0 0, 1 0 0 ] } }", "key 0 keyValue [ 1 1 1, 2 2 2 ]"));
    EXPECT_WORDS(notes(faces, ""));
    EXPECT_WORDS(notes(faces, "key [ 0 1 ] keyValue 1 1 1"));
    EXPECT_WORDS(notes(faces, "key [ 0 ] keyValue [ 1 1 1e38, 2 2 2, 3 3 3 ]"));
    EXPECT_WORDS(notes(faces, "key [ 1 0 ] keyValue [ 1 1 1, 2 2 2, 3 3 3, 4 4 4, 5 5 5, 6 6 6 ]"));
    // So many keys that each triangle would be there a million times.
    std::string keys, values, corners;
    for (int k = 0; k < 3000; ++k) {
        keys += fmt::format("{} ", k / 3000.0);
        values += fmt::format("0 0 {0}, 1 0 {0}, 0 1 {0}, ", k);
        corners += "0 1 2 -1 ";
    }
    EXPECT_WORDS(notes("IndexedFaceSet { coordIndex [ " + corners +
                           "] coord DEF C Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 "
                           "] } }",
                       "key [ " + keys + "] keyValue [ " + values + "]"));
}

TEST_F(CoinMorphFiles, MakeNormalsAnewThatWouldMove) {
    read("a.wrl", kMorphHead +
                      "Shape { geometry IndexedFaceSet { coordIndex [ 0 1 2 ] normal DEF N Normal { vector [ 0 0 1, 0 "
                      "0 1, 0 0 1 ] } coord DEF C Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } } }\nDEF T TimeSensor "
                      "{ loop TRUE } DEF I CoordinateInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 1 0 0, 0 1 0, 0 0 "
                      "0, 1 0 0, 0 0 1 ] }\nDEF J NormalInterpolator { key [ 0 1 ] keyValue [ 0 0 1, 0 0 1, 0 0 1, 0 "
                      "-1 0, 0 -1 0, 0 -1 0 ] } ROUTE T.fraction_changed TO I.set_fraction ROUTE I.value_changed TO "
                      "C.point ROUTE T.fraction_changed TO J.set_fraction ROUTE J.value_changed TO N.vector");
    EXPECT_TRUE(notes_.ends_with("a NormalInterpolator is left out: normals are made anew of points that move"))
        << notes_;
    ASSERT_EQ(skins_.size(), 1u);
    const Vec3d normal = vertexOf(skins_[0]->normals, skins_[0]->morphNormals, std::array{1.0}, 0);
    EXPECT_LT((normal - Vec3d(0, -1, 0)).norm(), 1e-5);
}

TEST_F(CoinMorphFiles, LevelsOfInventorGoByTheirSizeOnTheScreen) {
    // The box has sides of 8, 4 and 2 square units.
    read("a.iv",
         "#Inventor V2.1 ascii\nSeparator { Rotation { rotation 0 0 1 0.3 } Translation { translation 7 0 0 }\n"
         "DEF L LevelOfDetail { screenArea [ 10000, 900 ] Cube { width 4 height 2 depth 1 } Cube { width 2 height 1 "
         "depth 1 } Info {} } }");
    EXPECT_EQ(notes_, "");
    const auto* levels = aspect_->core<DistanceLOD>("/a/L/levels");
    ASSERT_NE(levels, nullptr);
    EXPECT_EQ(levels->measure, DistanceLOD::kSize);
    const auto ranges = levels->ranges.as<double>();
    EXPECT_EQ(std::vector<double>(ranges.begin(), ranges.end()), (std::vector<double>{100, 30}));
    EXPECT_NEAR(levels->radius, 0.5 * std::sqrt((8.0 + 4 + 2) / 3), 1e-6);
    EXPECT_LT(levels->center.norm(), 1e-6);
    read("b.iv", "#Inventor V2.1 ascii\nLevelOfDetail { screenArea [ 100, 200, 5 ] Cube {} Sphere {} Cone {} }");
    EXPECT_WORDS(notes_);
}

}  // namespace
}  // namespace tessera
