/// Who acts on the scene beside people: the order of the table's rows says who wins, and READMEs say the same order.
#include "server/sim/frame/Actors.h"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>
#include <sstream>

#include "common/cores/Animation.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Image.h"
#include "common/cores/Movie.h"
#include "common/cores/ParticleEmitter.h"
#include "common/cores/Skin.h"
#include "server/sim/FrameMaker.h"
#include "server/sim/frame/OutsideActors.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::ListMaker;

std::string pageOf(const std::string& path) {
    std::ifstream file(TESSERA_SOURCE_DIR "/" + path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

/// From where a page says this to the end of the paragraph, on one line.
std::string paragraphAt(const std::string& page, const std::string& begin) {
    const std::size_t from = page.find(begin);
    if (from == std::string::npos) return {};
    std::string text = page.substr(from, std::min(page.find("\n\n", from), page.find("\n- ", from)) - from);
    return std::regex_replace(text, std::regex("\\s+"), " ");
}

/// Of any Movie, whatever file it names: twelve pictures a second.
Expected<FileHandle> galleryFilm(const std::string&) {
    return FileHandle(::open(TESSERA_SOURCE_DIR "/deploy/scenes/gallery/film.avi", O_RDONLY | O_CLOEXEC));
}

/// A server's frames, with all who act, and a scene on which two want the same.
class Contest {
public:
    Contest()
        : view_(wall, ""),
          report_(wall, ""),
          log_("test"),
          outside(wall, drags_, galleryFilm),
          maker_({.simulation = simulation, .view = view_, .blobs = blobs_, .report = report_, .log = log_}) {
        simulation.actWith(outside);
    }

    ObjectId keys(ObjectId target, const std::string& field, const std::vector<double>& value) {
        const ObjectId id = make.create<KeyFrames>();
        std::vector<double> values(value);
        values.insert(values.end(), value.begin(), value.end());
        setField<&KeyFrames::target>(make.builder, id, target);
        setField<&KeyFrames::field>(make.builder, id, field);
        setField<&KeyFrames::times>(make.builder, id, Blob::of(std::span<const double>(std::vector<double>{0, 100})));
        setField<&KeyFrames::values>(make.builder, id, Blob::of(std::span<const double>(values)));
        return id;
    }
    /// One that always wants this.
    void animate(ObjectId target, const std::string& field, const std::vector<double>& value) {
        const ObjectId id = make.create<Animation>();
        setField<&Animation::channels>(make.builder, id, RefList{keys(target, field, value)});
        make.node("animation", kRootNode, id);
    }
    /// That always wants its target there.
    ObjectId move(ObjectId target, const Vec3d& there) {
        const ObjectId id = make.create<Motion>();
        std::vector<double> poses;
        for (const double time : {0.0, 100.0})
            poses.insert(poses.end(), {time, there.x(), there.y(), there.z(), 1, 0, 0, 0, 1, 1, 1});
        setField<&Motion::target>(make.builder, id, target);
        setField<&Motion::keys>(make.builder, id, Blob::of(std::span<const double>(poses)));
        setField<&Motion::playing>(make.builder, id, true);
        make.node("motion", kRootNode, id);
        return id;
    }
    /// What is made becomes the scene.
    void begin() {
        const Expected<void> loaded = maker_.load({make.builder.take()});
        ASSERT_TRUE(loaded) << loaded.error().message;
    }
    FrameResult frame(std::vector<Edit> edits = {}) {
        return maker_.make(FrameNumber(frames_++), std::move(edits), {}, {});
    }
    /// Frames, at the pace of a wall, until something holds; false: not in time.
    bool until(const std::function<bool()>& holds) {
        return test::eventually([&] {
            if (holds()) return true;
            frame();
            return false;
        });
    }

    [[nodiscard]] static ObjectId real(ObjectId placeholder) {
        return ObjectId(placeholder.value - kFirstPlaceholder + 2);
    }
    template <typename T>
    [[nodiscard]] const T& at(ObjectId placeholder) const {
        return *simulation.scene().get<T>(real(placeholder));
    }

    /// Who of two speaks later, by the rows; "people" speak after whoever says something before the step.
    [[nodiscard]] std::string later(const std::string& a, const std::string& b) const {
        return placeOf(a) < placeOf(b) ? b : a;
    }

    Wall wall = test::wallOfUsers(1);
    Simulation simulation;
    ListMaker make;

private:
    [[nodiscard]] std::size_t placeOf(const std::string& name) const {
        const std::span<const Actor> rows = simulation.actors().rows();
        if (name != "people") {
            const auto row = std::ranges::find(rows, name, &Actor::name);
            EXPECT_NE(row, rows.end()) << name;
            return 2 * static_cast<std::size_t>(row - rows.begin());
        }
        std::size_t last = 0;
        for (std::size_t i = 0; i < rows.size(); ++i)
            if (rows[i].ticket != 0) last = i;
        return 2 * last + 1;
    }

    ViewSource view_;
    BlobStore blobs_;
    Report report_;
    Log log_;
    ManipulatorDrags drags_;

public:
    OutsideActors outside;

private:
    FrameMaker maker_;
    std::uint64_t frames_ = 0;
};

TEST(Actors, SpeakInTheOrderThatTheReadmesSay) {
    Simulation simulation;
    std::vector<std::string> rows;
    for (const Actor& actor : simulation.actors().rows()) rows.emplace_back(actor.name);

    const std::string said = paragraphAt(pageOf("server/sim/frame/README.md"), "- **Order.**");
    std::vector<std::string> inReadme;
    const std::regex quoted("`([a-z ]+)`");
    for (std::sregex_iterator word(said.begin(), said.end(), quoted), end; word != end; ++word)
        if (std::ranges::find(rows, (*word)[1].str()) != rows.end()) inReadme.push_back((*word)[1]);
    EXPECT_EQ(inReadme, rows) << said;

    for (const auto& [page, begin] : {std::pair("deploy/using.md", "In each frame motions"),
                                      std::pair("common/application/README.md", "**Conflicts.**")}) {
        const std::string text = paragraphAt(pageOf(page), begin);
        const std::size_t motions = text.find("motions"), animations = text.find("animations"),
                          people = std::min(text.find("then edits"), text.find("then the proposals"));
        EXPECT_LT(motions, animations) << page;
        EXPECT_LT(animations, people) << page;
        EXPECT_NE(people, std::string::npos) << page;
    }
}

TEST(Actors, SpeakFirstInTheStepOrBeforePeopleOrLast) {
    Contest contest;
    int stage = 0;
    for (const Actor& actor : contest.simulation.actors().rows()) {
        const int speaks = actor.want ? 1 : actor.ticket != 0 ? 2 : actor.settle ? 3 : 4;
        EXPECT_LE(stage, speaks) << actor.name;
        stage = speaks;
        EXPECT_TRUE(actor.ticket == 0 || actor.say) << actor.name;
        EXPECT_FALSE(actor.want && actor.say) << actor.name << ": it would speak twice";
    }
}

TEST(Actors, OfMotionAndAnimationTheLaterRowMovesTheThing) {
    Contest contest;
    const ObjectId place = contest.make.transform(Vec3d::Zero());
    contest.make.node("thing", kRootNode, place);
    contest.move(place, {1, 0, 0});
    contest.animate(place, "translation", {2, 0, 0});
    contest.begin();
    contest.frame();
    EXPECT_EQ(contest.at<Transform>(place).translation.x(),
              contest.later("motions", "animations") == "motions" ? 1 : 2);
}

TEST(Actors, OfMotionOrAnimationAndPeopleTheLaterRowMovesTheThing) {
    for (const std::string actor : {"motions", "animations"}) {
        Contest contest;
        const ObjectId place = contest.make.transform(Vec3d::Zero());
        contest.make.node("thing", kRootNode, place);
        if (actor == "motions")
            contest.move(place, {1, 0, 0});
        else
            contest.animate(place, "translation", {1, 0, 0});
        contest.begin();
        contest.frame();
        ASSERT_EQ(contest.at<Transform>(place).translation.x(), 1);
        ChangeListBuilder hand;
        setField<&Transform::translation>(hand, Contest::real(place), Vec3d(7, 0, 0));
        contest.frame(test::one(hand.take()));
        EXPECT_EQ(contest.at<Transform>(place).translation.x(), contest.later(actor, "people") == "people" ? 7 : 1)
            << actor;
        contest.frame();
        EXPECT_EQ(contest.at<Transform>(place).translation.x(), 7) << actor << " is paused";
    }
}

TEST(Actors, OfAnimationAndEmittersTheLaterRowSaysTheStreamsTime) {
    Contest contest;
    const ObjectId core = contest.make.create<ParticleEmitter>();
    contest.make.node("fountain", kRootNode, core);
    contest.animate(core, "time", {30});
    contest.begin();
    contest.frame();
    contest.frame();
    EXPECT_EQ(contest.at<ParticleEmitter>(core).time,
              contest.later("animations", "emitters") == "animations" ? 30 : 30 + kSecondsPerFrame);
    ChangeListBuilder hand;
    setField<&ParticleEmitter::time>(hand, Contest::real(core), 7.0);
    contest.frame(test::one(hand.take()));
    EXPECT_EQ(contest.at<ParticleEmitter>(core).time,
              contest.later("emitters", "people") == "people" ? 7 : 7 + kSecondsPerFrame);
}

TEST(Actors, OfAnimationAndFilmsTheLaterRowSaysTheFilmsTime) {
    Contest contest;
    const ObjectId image = contest.make.create<Image>();
    const std::vector<std::uint8_t> black = {0, 0, 0, 255};
    setField<&Image::pixels>(contest.make.builder, image, Blob::of(std::span<const std::uint8_t>(black)));
    setField<&Image::widthPx>(contest.make.builder, image, std::int64_t{1});
    setField<&Image::heightPx>(contest.make.builder, image, std::int64_t{1});
    const ObjectId film = contest.make.create<Movie>();
    setField<&Movie::file>(contest.make.builder, film, std::string("film.avi"));
    setField<&Movie::image>(contest.make.builder, film, image);
    contest.make.node("film", kRootNode, film);
    contest.animate(film, "time", {5000});
    contest.begin();
    contest.frame();
    EXPECT_EQ(contest.at<Movie>(film).time, 5000) << "the film says nothing before it shows a picture";
    ASSERT_TRUE(contest.until([&] { return contest.at<Image>(image).widthPx > 1; })) << contest.at<Movie>(film).problem;
    contest.frame();
    const bool films = contest.later("animations", "films") == "films";
    EXPECT_EQ(contest.at<Movie>(film).time < 100, films) << "of a film that goes round, within its length";

    ChangeListBuilder hand;
    setField<&Movie::time>(hand, Contest::real(film), 7000.0);
    contest.frame(test::one(hand.take()));
    EXPECT_EQ(contest.at<Movie>(film).time == 7000, contest.later("films", "people") == "people");
}

TEST(Actors, OfAnimationAndLevelsTheLaterRowChoosesTheLevel) {
    Contest contest;
    const ObjectId core = contest.make.create<DistanceLOD>();
    setField<&DistanceLOD::ranges>(contest.make.builder, core,
                                   Blob::of(std::span<const double>(std::vector<double>{1})));
    setField<&DistanceLOD::center>(contest.make.builder, core, Vec3d(0, 0, -500));
    const ObjectId node = contest.make.node("thing", kRootNode, core);
    contest.make.node("near", node, contest.make.box({1, 1, 1}));
    contest.make.node("far", node, contest.make.box({1, 1, 1}));
    contest.animate(node, "levels", {2});
    contest.begin();
    contest.frame();
    EXPECT_EQ(static_cast<std::uint64_t>(contest.at<Node>(node).levels),
              contest.later("animations", "levels") == "levels" ? 0x0101010101010101u : 2u);
}

TEST(Actors, OfAnimationAndSkinsTheLaterRowSaysTheSkinsPose) {
    Contest contest;
    const ObjectId joint = contest.make.node("joint", kRootNode, contest.make.transform({3, 0, 0}));
    const MeshArrays box = makeBox(Vec3d::Ones()).toArrays();
    const std::size_t vertices = box.positions.sizeBytes() / 12;
    const ObjectId skin = contest.make.create<Skin>();
    std::vector<float> weights;
    for (std::size_t k = 0; k < 4 * vertices; ++k) weights.push_back(k % 4 == 0);
    const std::vector<float> bind = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    setField<&Skin::positions>(contest.make.builder, skin, box.positions);
    setField<&Skin::normals>(contest.make.builder, skin, box.normals);
    setField<&Skin::indices>(contest.make.builder, skin, box.indices);
    setField<&Skin::jointIndices>(
        contest.make.builder, skin,
        Blob::of(std::span<const std::uint16_t>(std::vector<std::uint16_t>(4 * vertices, 0))));
    setField<&Skin::jointWeights>(contest.make.builder, skin, Blob::of(std::span<const float>(weights)));
    setField<&Skin::inverseBinds>(contest.make.builder, skin, Blob::of(std::span<const float>(bind)));
    setField<&Skin::pose>(contest.make.builder, skin, Blob::of(std::span<const float>(bind)));
    setField<&Skin::joints>(contest.make.builder, skin, RefList{joint});
    contest.make.node("skin", kRootNode, skin);
    contest.animate(skin, "pose", {1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0});
    contest.begin();
    contest.frame();
    EXPECT_EQ(contest.at<Skin>(skin).pose.as<float>()[3], contest.later("animations", "skins") == "skins" ? 3 : 9);
}

TEST(Actors, OfMotionAndAnimationOrPeopleTheLaterRowSaysTheMotionsTime) {
    Contest contest;
    const ObjectId place = contest.make.transform(Vec3d::Zero());
    contest.make.node("thing", kRootNode, place);
    const ObjectId motion = contest.move(place, {1, 0, 0});
    contest.begin();
    contest.frame();
    contest.frame();
    EXPECT_EQ(contest.at<Motion>(motion).time, kSecondsPerFrame);
    ChangeListBuilder hand;
    setField<&Motion::time>(hand, Contest::real(motion), 7.0);
    contest.frame(test::one(hand.take()));
    EXPECT_EQ(contest.at<Motion>(motion).time,
              contest.later("motions", "people") == "people" ? 7 : 2 * kSecondsPerFrame);
    contest.frame();
    EXPECT_EQ(contest.at<Motion>(motion).time, 7 + kSecondsPerFrame) << "and it plays on";

    Contest other;
    const ObjectId otherPlace = other.make.transform(Vec3d::Zero());
    other.make.node("thing", kRootNode, otherPlace);
    const ObjectId driven = other.move(otherPlace, {1, 0, 0});
    other.animate(driven, "time", {50});
    other.begin();
    other.frame();
    EXPECT_EQ(other.at<Motion>(driven).time, other.later("motions", "animations") == "animations" ? 50 : 0);
}

// A new one is its class and a row: here a row alone.
TEST(Actors, ARowMoreActsAsItsPlaceSays) {
    ListMaker make;
    const ObjectId place = make.transform(Vec3d::Zero());
    make.node("thing", kRootNode, place);
    Committer committer;
    const auto made = committer.apply(make.builder.take());
    ASSERT_TRUE(made) << made.error().message;
    const ObjectId id = made->ids[0].second;
    std::vector<std::string> remarks, told;
    ServersHand hand(committer, [&](const ChangeList*) { told.emplace_back("applied"); });
    Wishes wishes;
    ActorStage stage{.hand = hand, .seconds = 1, .wishes = wishes, .remarks = remarks};
    const auto wanting = [&](double x) {
        return Actor{.name = "row", .want = [=](ActorStage& now) {
                         ChangeListBuilder list;
                         setField<&Transform::translation>(list, id, Vec3d(x, 0, 0));
                         EXPECT_TRUE(now.hand.apply(list.take()));
                     }};
    };
    std::vector<Actor> rows;
    rows.push_back(wanting(1));
    rows.push_back(wanting(2));
    const ActorTable table(std::move(rows));
    table.want(stage);
    EXPECT_EQ(committer.scene().get<Transform>(id)->translation.x(), 2);
    EXPECT_EQ(told.size(), 2u);
}

TEST(Actors, WhatTheySayComesBeforeWhatPeopleSayAndIsNobodysStep) {
    const auto saying = [](std::uint64_t ticket) {
        return Actor{.name = "row", .ticket = ticket, .say = [](const Occasion&) {
                         std::vector<ChangeList> lists(2);
                         ChangeListBuilder list;
                         list.create(ObjectId{kFirstPlaceholder}, typeOf<Transform>());
                         lists[1] = list.take();
                         return lists;
                     }};
    };
    std::vector<Actor> rows;
    rows.push_back(saying(8));
    rows.push_back(saying(9));
    const ActorTable table(std::move(rows));
    const Aspect scene;
    const View view;
    std::vector<Edit> edits(1);
    edits[0].ticket = 7;
    table.say({.scene = scene, .view = view, .frame = {}, .now = {}}, edits);
    ASSERT_EQ(edits.size(), 3u) << "an empty list is nothing";
    EXPECT_EQ(edits[0].ticket, 8u);
    EXPECT_EQ(edits[1].ticket, 9u);
    EXPECT_EQ(edits[2].ticket, 7u);
    EXPECT_FALSE(edits[0].undoable || edits[1].undoable);
    EXPECT_TRUE(edits[2].undoable);
}

}  // namespace
}  // namespace tessera
