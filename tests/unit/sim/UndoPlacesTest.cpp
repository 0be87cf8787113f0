/// Undo and redo are no motions: they put things where these were, unless something else stands there now.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::moveTo;
using test::one;
using test::placeOf;
using test::transformAt;

double uniform(Random& random, double least, double most) {
    return least + (most - least) * static_cast<double>(random() >> 11) * 0x1p-53;
}

/// Boxes "a", "b", … of size 1, each a node with a Transform and one below it, all of which stop each other.
struct Boxes {
    explicit Boxes(const std::vector<Vec3d>& places, const std::vector<Vec3d>& sizes = {},
                   std::int64_t response = Interest::kStop) {
        test::ListMaker make;
        std::vector<ObjectId> nodes;
        for (std::size_t i = 0; i < places.size(); ++i) {
            nodes.push_back(
                make.node(std::string(1, static_cast<char>('a' + i)), kRootNode, make.transform(places[i])));
            make.node("box", nodes.back(), make.box(i < sizes.size() ? sizes[i] : Vec3d(Vec3d::Ones())));
        }
        for (const ObjectId node : nodes) {
            const ObjectId interest = make.create<Interest>();
            setField<&Interest::object>(make.builder, interest, node);
            setField<&Interest::response>(make.builder, interest, response);
            make.node("interest", kRootNode, interest);
        }
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        (void)simulation.step(true, {});
        first = hash();
    }
    [[nodiscard]] StateHash hash() const { return simulation.scene().stateHash(); }
    [[nodiscard]] std::size_t undo() const { return simulation.history().undoDepth(); }
    [[nodiscard]] std::size_t redo() const { return simulation.history().redoDepth(); }
    [[nodiscard]] ObjectId core(const std::string& path) const { return transformAt(simulation.scene(), path); }
    [[nodiscard]] Vec3d at(const std::string& path) const { return placeOf(simulation.scene(), path); }
    EditOutcome edit(ChangeList list, Gesture gesture = {}) {
        return simulation.step(false, one(std::move(list), gesture)).outcomes.front();
    }
    EditOutcome move(const std::string& path, const Vec3d& to, Gesture gesture = {}) {
        return edit(moveTo(core(path), to), gesture);
    }
    /// Nobody's step.
    void byItself(ChangeList list) {
        std::vector<Edit> edits = one(std::move(list));
        edits.front().undoable = false;
        EXPECT_TRUE(simulation.step(false, std::move(edits)).outcomes.front().result);
    }
    /// Over the others, so that none is in between.
    void standByItself(const std::string& path, const Vec3d& place) {
        const Vec3d up(0, 0, 20);
        for (const Vec3d& next : {Vec3d(at(path) + up), Vec3d(place + up), place}) byItself(moveTo(core(path), next));
    }
    EditOutcome go(Edit::Kind kind) { return simulation.step(false, one(kind)).outcomes.front(); }
    EditOutcome goBack() { return go(Edit::Kind::kUndo); }
    EditOutcome goForth() { return go(Edit::Kind::kRedo); }

    Simulation simulation;
    StateHash first;
};

TEST(UndoPlaces, AfterAWayOutOfAnOverlapUndoLeadsBackIntoIt) {
    Boxes show({Vec3d::Zero(), Vec3d(0.6, 0.1, 0.2)});
    for (int i = 0; i < 3; ++i) (void)show.move("/a", Vec3d(-3, 0, 0), {7, 1});
    ASSERT_EQ(show.at("/a"), Vec3d(-3, 0, 0));
    ASSERT_EQ(show.undo(), 1u);
    const StateHash out = show.hash();
    for (int i = 0; i < 3; ++i) {
        const EditOutcome back = show.goBack();
        ASSERT_TRUE(back.result) << back.result.error().message;
        EXPECT_TRUE(back.result->stopped.empty());
        ASSERT_EQ(show.hash(), show.first);
        ASSERT_TRUE(show.goForth().result);
        ASSERT_EQ(show.hash(), out);
    }
}

TEST(UndoPlaces, UndoGoesThroughWhatIsInBetween) {
    Boxes show({Vec3d::Zero(), Vec3d(10, 0, 0)});
    ASSERT_TRUE(show.move("/a", Vec3d(-5, 0, 0)).result->stopped.empty());
    show.standByItself("/b", Vec3d(-2.5, 0, 0));
    ASSERT_TRUE(show.goBack().result);
    EXPECT_EQ(show.at("/a"), Vec3d::Zero());
}

TEST(UndoPlaces, WhatStandsThereNowIsNamedAndTheStepStays) {
    Boxes show({Vec3d::Zero(), Vec3d(10, 0, 0)});
    ASSERT_TRUE(show.move("/a", Vec3d(-5, 0, 0)).result->stopped.empty());
    show.standByItself("/b", Vec3d(0.5, 0, 0));
    const StateHash before = show.hash();
    for (int i = 0; i < 2; ++i) {
        const EditOutcome refused = show.goBack();
        ASSERT_FALSE(refused.result);
        EXPECT_EQ(refused.result.error().code, ErrorCode::kRefused);
        EXPECT_EQ(
            refused.result.error().message,
            "/b/box stands where /a/box was; nothing has moved, and the step can be undone once that place is free");
        EXPECT_EQ(show.hash(), before);
        EXPECT_EQ(show.undo(), 1u);
        EXPECT_EQ(show.redo(), 0u);
    }
    show.standByItself("/b", Vec3d(10, 0, 0));
    ASSERT_TRUE(show.goBack().result);
    EXPECT_EQ(show.hash(), show.first);
    show.standByItself("/b", Vec3d(-5, 0.5, 0));
    const EditOutcome refused = show.goForth();
    ASSERT_FALSE(refused.result);
    EXPECT_WORDS(refused.result.error().message);
    EXPECT_EQ(show.redo(), 1u);
    show.standByItself("/b", Vec3d(10, 0, 0));
    ASSERT_TRUE(show.goForth().result);
    EXPECT_EQ(show.at("/a"), Vec3d(-5, 0, 0));
}

TEST(UndoPlaces, AStepOfSeveralIsTakenBackWholeOrNotAtAll) {
    Boxes show({Vec3d::Zero(), Vec3d(3, 0, 0), Vec3d(20, 0, 0)});
    ChangeListBuilder list;
    setField<&Transform::translation>(list, show.core("/a"), Vec3d(0, 5, 0));
    setField<&Transform::translation>(list, show.core("/b"), Vec3d(3, 5, 0));
    const ObjectId c = findNode(show.simulation.scene(), "/c").value();
    setField<&Node::name>(list, c, std::string("other"));
    ASSERT_TRUE(show.edit(list.take()).result);
    show.standByItself("/other", Vec3d(3, 0, 0));
    const StateHash before = show.hash();
    const EditOutcome refused = show.goBack();
    ASSERT_FALSE(refused.result);
    EXPECT_WORDS(refused.result.error().message);
    EXPECT_EQ(show.hash(), before);
    show.standByItself("/other", Vec3d(20, 0, 0));
    ASSERT_TRUE(show.goBack().result);
    EXPECT_EQ(show.hash(), show.first);
}

/// What the step itself takes away, brings or moves is where the step says.
TEST(UndoPlaces, PartsOfAStepAreNotInEachOthersWay) {
    Boxes show({Vec3d::Zero(), Vec3d(3, 0, 0)});
    test::ListMaker make;
    setField<&Transform::translation>(make.builder, show.core("/a"), Vec3d(0, 5, 0));
    const ObjectId crate = make.node("crate", kRootNode, make.transform(Vec3d(0.1, -0.6, 0.2)));
    make.node("box", crate, make.box(Vec3d::Ones()));
    ASSERT_TRUE(show.edit(make.builder.take()).result);
    ASSERT_TRUE(findNode(show.simulation.scene(), "/crate"));
    const StateHash there = show.hash();
    // Where it was the crate stands that came with the same edit.
    for (int i = 0; i < 2; ++i) {
        const EditOutcome back = show.goBack();
        ASSERT_TRUE(back.result) << back.result.error().message;
        EXPECT_EQ(show.hash(), show.first);
        ASSERT_TRUE(show.goForth().result);
        EXPECT_EQ(show.hash(), there);
    }
}

TEST(UndoPlaces, WhatComesBackWithItsNodesIsThere) {
    Boxes show({Vec3d::Zero(), Vec3d(3, 0, 0)});
    ChangeListBuilder remove;
    const ObjectId box = findNode(show.simulation.scene(), "/a/box").value();
    remove.detach(box);
    remove.destroy(box);
    ASSERT_TRUE(show.edit(remove.take()).result);
    show.standByItself("/b", Vec3d(0.5, 0, 0));
    ASSERT_TRUE(show.goBack().result);
    EXPECT_TRUE(findNode(show.simulation.scene(), "/a/box"));
    EXPECT_EQ(show.at("/b"), Vec3d(0.5, 0, 0));
}

TEST(UndoPlaces, AMotionOfTheSameFrameIsTriedAgainstWhatWasPutBack) {
    Boxes show({Vec3d::Zero(), Vec3d(3, 0, 0)});
    ASSERT_TRUE(show.move("/a", Vec3d(-5, 0, 0)).result->stopped.empty());
    std::vector<Edit> edits = one(Edit::Kind::kUndo);
    edits.push_back({.ticket = 2, .list = moveTo(show.core("/b"), Vec3d::Zero())});
    const FrameResult frame = show.simulation.step(false, std::move(edits));
    ASSERT_TRUE(frame.outcomes[0].result);
    EXPECT_EQ(show.at("/a"), Vec3d::Zero());
    EXPECT_EQ(frame.outcomes[1].result->stopped, std::vector{show.core("/b")});
    EXPECT_GT(show.at("/b").x(), 1);
}

TEST(UndoPlaces, AStepBehindAMoveOfItsFrameWaitsForTheNext) {
    Boxes show({Vec3d::Zero(), Vec3d(3, 0, 0)});
    std::vector<Edit> edits = one(moveTo(show.core("/a"), Vec3d(8, 0, 0)));
    edits.push_back({.ticket = 2, .kind = Edit::Kind::kUndo});
    const FrameResult frame = show.simulation.step(false, std::move(edits));
    ASSERT_FALSE(frame.outcomes[1].result);
    EXPECT_WORDS(frame.outcomes[1].result.error().message);
    ASSERT_TRUE(show.goBack().result);
    EXPECT_EQ(show.hash(), show.first);
    ASSERT_TRUE(show.goForth().result);
    EXPECT_LT(show.at("/a").x(), 3) << "where it was stopped, not where it was wanted";
}

/// In the frame in which two move, the one may come to stand where the other one was.
TEST(UndoPlaces, TwoEditsOfAFrameThatChangePlacesAreTakenBackOneByOne) {
    for (const bool turned : {false, true}) {
        Boxes show({Vec3d::Zero(), Vec3d(1.5, 0, 0)});
        std::vector<Edit> edits;
        edits.push_back({.ticket = 1, .list = moveTo(show.core("/a"), Vec3d(0, 5, 0))});
        edits.push_back({.ticket = 2, .list = moveTo(show.core("/b"), Vec3d(0.2, 0, 0))});
        if (turned) std::swap(edits[0], edits[1]);
        for (const EditOutcome& outcome : show.simulation.step(false, std::move(edits)).outcomes)
            ASSERT_TRUE(outcome.result->stopped.empty());
        const StateHash there = show.hash();
        for (int i = 0; i < 2; ++i) {
            const EditOutcome back = show.goBack();
            ASSERT_TRUE(back.result) << back.result.error().message;
        }
        EXPECT_EQ(show.hash(), show.first);
        for (int i = 0; i < 2; ++i) ASSERT_TRUE(show.goForth().result);
        EXPECT_EQ(show.hash(), there);
    }
}

TEST(UndoPlaces, AGrabIsOneStepWhoeverEditsInBetween) {
    Boxes show({Vec3d::Zero(), Vec3d(10, 0, 0)});
    for (int i = 1; i <= 20; ++i) {
        (void)show.move("/a", Vec3d(0, 0.1 * i, 0), {7, 1});
        (void)show.move("/b", Vec3d(10, -0.1 * i, 0), {8, 1});
    }
    EXPECT_EQ(show.undo(), 2u);
    const StateHash there = show.hash();
    ASSERT_TRUE(show.goBack().result);
    EXPECT_EQ(show.at("/b"), Vec3d(10, 0, 0));
    EXPECT_EQ(show.at("/a").y(), 2);
    ASSERT_TRUE(show.goBack().result);
    EXPECT_EQ(show.hash(), show.first);
    for (int i = 0; i < 2; ++i) ASSERT_TRUE(show.goForth().result);
    EXPECT_EQ(show.hash(), there);
}

TEST(UndoPlaces, AGrabThatEndsWhereItBeganIsNoStep) {
    Boxes show({Vec3d::Zero(), Vec3d(10, 0, 0)});
    for (const double x : {1.0, 2.0, 1.0, 0.0}) (void)show.move("/a", Vec3d(x, 0, 0), {7, 1});
    EXPECT_EQ(show.hash(), show.first);
    EXPECT_EQ(show.undo(), 0u);
    for (const double x : {1.0, 0.0, 2.0}) (void)show.move("/a", Vec3d(x, 0, 0), {7, 1});
    EXPECT_EQ(show.undo(), 1u);
    ASSERT_TRUE(show.goBack().result);
    EXPECT_EQ(show.hash(), show.first);
}

/// Then the two cannot be taken back in either order, and the grab goes on as another step.
TEST(UndoPlaces, WhereSomebodyElseMovesTheSameMeanwhileTheGrabIsTwoSteps) {
    Boxes show({Vec3d::Zero(), Vec3d(10, 0, 0)});
    (void)show.move("/a", Vec3d(1, 0, 0), {7, 1});
    (void)show.move("/a", Vec3d(1, 3, 0), {8, 1});
    (void)show.move("/a", Vec3d(2, 0, 0), {7, 1});
    (void)show.move("/a", Vec3d(3, 0, 0), {7, 1});
    EXPECT_EQ(show.undo(), 3u);
    for (const Vec3d& place : {Vec3d(1, 3, 0), Vec3d(1, 0, 0), Vec3d(0, 0, 0)}) {
        ASSERT_TRUE(show.goBack().result);
        EXPECT_EQ(show.at("/a"), place);
    }
}

/// The step of the other one could not be taken back first.
TEST(UndoPlaces, WhereAGrabComesToStandWhereAnotherBeganItIsTwoSteps) {
    Boxes show({Vec3d::Zero(), Vec3d(10, 0, 0)});
    (void)show.move("/a", Vec3d(1, 0, 0), {7, 1});
    (void)show.move("/b", Vec3d(10, 5, 0), {8, 1});
    (void)show.move("/a", Vec3d(10, 0, 0), {7, 1});
    EXPECT_EQ(show.undo(), 3u);
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(show.goBack().result);
    EXPECT_EQ(show.hash(), show.first);
}

/// First states that overlap, touch, are thin; ways that are long; all responses; edits of a frame together, drags,
/// nodes that go.
TEST(UndoPlaces, WhereOnlyStepsActUndoOfAllLeadsToTheFirstStateAndRedoToTheLast) {
    forSeeds(400, [](Random& random) {
        std::vector<Vec3d> places, sizes;
        const std::size_t many = 3 + below(random, 4);
        const bool exact = oneIn(random, 2);  // flush, with touching faces
        for (std::size_t i = 0; i < many; ++i) {
            const auto any = [&](double most) {
                return exact ? static_cast<double>(below(random, static_cast<std::size_t>(2 * most))) / 2
                             : uniform(random, 0, most);
            };
            places.emplace_back(any(4), any(2), any(2));
            const double thin = oneIn(random, 3) ? 0 : oneIn(random, 3) ? 1e-3 : 1;
            sizes.emplace_back(1 + any(2), 1, thin);
        }
        constexpr std::int64_t kResponses[] = {Interest::kStop, Interest::kSlide, Interest::kBounce,
                                               Interest::kRollback, Interest::kAsk};
        Boxes show(places, sizes, kResponses[below(random, std::size(kResponses))]);
        const bool nested = oneIn(random, 2);
        if (nested) {
            test::ListMaker make;
            const ObjectId arm =
                make.node("arm", findNode(show.simulation.scene(), "/a").value(), make.transform(Vec3d(0, 2, 0)));
            make.node("box", arm, make.box(Vec3d::Ones()));
            show.byItself(make.builder.take());
            show.first = show.hash();
        }
        for (int i = 0; i < 25; ++i) {
            std::vector<Edit> edits;
            for (std::size_t k = oneIn(random, 3) ? 1 + below(random, 3) : 1; k > 0; --k) {
                const Gesture gesture{1 + below(random, 2), below(random, 3)};
                if (oneIn(random, 3)) {  // by so much: several of a frame add up
                    const auto& children = show.simulation.scene().root().children;
                    const double far = oneIn(random, 4) ? 1e4 : 3;
                    NodeMove move{.translation =
                                      Vec3d(uniform(random, -far, far), uniform(random, -1, 1), uniform(random, -1, 1)),
                                  .relative = true};
                    if (oneIn(random, 6))
                        move.rotation = Quatd(Eigen::AngleAxisd(uniform(random, 0, 3), Vec3d::UnitY()));
                    edits.push_back({.ticket = k,
                                     .gesture = gesture,
                                     .move = move,
                                     .node = children[below(random, std::min<std::size_t>(children.size(), 2))]});
                    continue;
                }
                test::ListMaker make;
                for (std::size_t parts = 1 + below(random, 2); parts > 0; --parts) {
                    const auto& children = show.simulation.scene().root().children;
                    const Expected<ObjectId> arm = findNode(show.simulation.scene(), "/a/arm");
                    const ObjectId node =
                        arm && oneIn(random, 2)
                            ? (oneIn(random, 2) ? *arm : show.simulation.scene().get<Node>(*arm)->parent)
                            : children[below(random, children.size())];
                    const ObjectId core = show.simulation.scene().get<Node>(node)->core;
                    const Transform* transform = show.simulation.scene().get<Transform>(core);
                    if (oneIn(random, 12)) {
                        const ObjectId crate =
                            make.node("crate", kRootNode, make.transform(Vec3d(uniform(random, 0, 4), 0, 0)));
                        make.node("box", crate, make.box(Vec3d::Ones()));
                    } else if (transform && oneIn(random, 12) && parts == 1) {
                        for (const ObjectId gone : {show.simulation.scene().get<Node>(node)->children.front(), node}) {
                            make.builder.detach(gone);
                            make.builder.destroy(gone);
                        }
                    } else if (transform && oneIn(random, 6)) {
                        setField<&Transform::rotation>(make.builder, core,
                                                       Quatd(Eigen::AngleAxisd(uniform(random, 0, 3), Vec3d::UnitY())));
                    } else if (transform) {
                        const double far = oneIn(random, 4) ? 1e4 : 3;
                        const Vec3d by(uniform(random, -far, far), uniform(random, -1, 1), uniform(random, -1, 1));
                        setField<&Transform::translation>(make.builder, core, Vec3d(transform->translation + by));
                    }
                }
                edits.push_back({.ticket = k, .list = make.builder.take(), .gesture = gesture});
            }
            (void)show.simulation.step(false, std::move(edits));
        }
        const StateHash last = show.hash();
        for (int round = 0; round < 2; ++round) {
            while (show.undo() > 0) {
                const EditOutcome back = show.goBack();
                ASSERT_TRUE(back.result) << back.result.error().message << ", " << show.undo() << " steps are left";
                ASSERT_TRUE(back.result->stopped.empty());
            }
            ASSERT_EQ(show.hash(), show.first);
            while (show.redo() > 0) {
                const EditOutcome forth = show.goForth();
                ASSERT_TRUE(forth.result) << forth.result.error().message << ", " << show.redo() << " steps are left";
            }
            ASSERT_EQ(show.hash(), last);
        }
    });
}

/// Cubes of one size, so that whether two touch is a matter of their places.
TEST(UndoPlaces, WhereOthersActItIsRefusedJustWhereSomethingElseStandsThere) {
    std::size_t refused = 0, done = 0;
    forSeeds(120, [&](Random& random) {
        using Places = std::map<std::string, Vec3d>;
        Places at;
        std::vector<Vec3d> places;
        for (char name = 'a'; name < 'f'; ++name) {
            places.emplace_back(static_cast<double>(below(random, 8)) * 0.75,
                                static_cast<double>(below(random, 2)) * 0.75, 0);
            at["/" + std::string(1, name)] = places.back();
        }
        Boxes show(places);
        const auto present = [&] {
            Places now;
            for (const auto& [path, place] : at) now[path] = show.at(path);
            return now;
        };
        const auto touch = [](const Places& in, const std::string& x, const std::string& y) {
            return x != y && ((in.at(x) - in.at(y)).cwiseAbs().array() <= 1).all();
        };
        struct Step {
            std::string who;
            Places then;  ///< to which it leads
        };
        std::vector<Step> back, forth;
        const auto anybody = [&] { return "/" + std::string(1, static_cast<char>('a' + below(random, 5))); };
        const auto somewhere = [&] {
            return Vec3d(static_cast<double>(below(random, 8)) * 0.75, static_cast<double>(below(random, 2)) * 0.75, 0);
        };
        for (int i = 0; i < 60; ++i) {
            const Places before = present();
            const std::string who = anybody();
            switch (below(random, 4)) {
                case 0:
                    (void)show.move(who, somewhere());
                    if (present() == before) break;
                    back.push_back({who, before});
                    forth.clear();
                    break;
                case 1:
                    // A Transform that is put aside by what is no motion: others' nodes come and go.
                    show.standByItself(who, somewhere());
                    break;
                default: {
                    const bool undo = oneIn(random, 2);
                    std::vector<Step>&from = undo ? back : forth, &to = undo ? forth : back;
                    if (from.empty()) break;
                    const Step step = from.back();
                    Places target = before;
                    target[step.who] = step.then.at(step.who);
                    const bool stands = std::ranges::any_of(at, [&](const auto& other) {
                        return touch(target, step.who, other.first) && !touch(step.then, step.who, other.first);
                    });
                    const EditOutcome outcome = show.go(undo ? Edit::Kind::kUndo : Edit::Kind::kRedo);
                    ASSERT_EQ(outcome.result.has_value(), !stands);
                    ASSERT_EQ(present(), stands ? before : target);
                    (stands ? refused : done) += 1;
                    if (stands) break;
                    from.pop_back();
                    to.push_back({step.who, before});
                }
            }
            ASSERT_EQ(show.undo(), back.size());
            ASSERT_EQ(show.redo(), forth.size());
        }
    });
    EXPECT_GT(done, 0u);
    EXPECT_GT(refused, 0u);
}

}  // namespace
}  // namespace tessera
