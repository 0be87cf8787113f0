/// Where the wall stands: after any history what a walk over the whole scene says, at a cost of what changed.
#include "server/sim/view/ViewSource.h"

#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "common/codec/WallCodec.h"
#include "common/scene/Action.h"
#include "server/sim/view/AnimatedBounds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/RandomTree.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::RandomTree;

Wall oneScreen() {
    Wall wall;
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = Vec3d(-1, 0, 0);
    screen.lowerRight = Vec3d(1, 0, 0);
    screen.upperLeft = Vec3d(-1, 1, 0);
    wall.screens = {screen};
    wall.users = {User{.name = "viewer", .position = Vec3d(0, 0.5, 2)}};
    return wall;
}

/// The whole walk.
struct Seen {
    ObjectId node;
    Affine3d world = Affine3d::Identity();
    double scale = 0;
};
Seen firstByWalking(const Aspect& scene) {
    Seen seen;
    Action action;
    action.on<Camera>([&](const Visit& visit, const Camera& camera) {
        if (!seen.node && camera.enabled) seen = {visit.nodeId, visit.world_T_node, camera.worldUnitsPerMetre};
        return Descend::kInto;
    });
    action.run(scene);
    return seen;
}

std::vector<ObjectId> allByWalking(const Aspect& scene) {
    std::vector<ObjectId> all;
    Action action;
    action.on<Camera>([&](const Visit& visit, const Camera&) {
        all.push_back(visit.nodeId);
        return Descend::kInto;
    });
    action.run(scene);
    return all;
}

bool sameBits(const View& view, const Seen& seen) {
    const Vec3d position = seen.world.translation();
    const Quatd orientation = Quatd(seen.world.rotation()).normalized();
    return std::memcmp(view.position.data(), position.data(), sizeof(Vec3d)) == 0 &&
           std::memcmp(view.orientation.coeffs().data(), orientation.coeffs().data(), sizeof(double) * 4) == 0 &&
           view.worldUnitsPerMetre == seen.scale;
}

TEST(ViewSource, TheFirstCameraIsTheOneThatAWalkFindsAfterAnyHistory) {
    std::size_t cameras = 0, none = 0, several = 0, changes = 0, many = 0;
    forSeeds(30, [&](Random& random) {
        RandomTree tree(random);
        ViewSource eachList(oneScreen(), ""), eachFrame(oneScreen(), "");
        FirstCamera fresh;
        ObjectId last;
        for (int frame = 0; frame < 120; ++frame) {
            for (std::size_t lists = 1 + below(random, 3); lists > 0; --lists) {
                const ChangeListPtr list = tree.next();
                if (!list) continue;
                eachList.update(tree.scene(), oneIn(random, 30) ? nullptr : list.get());
                const Seen seen = firstByWalking(tree.scene());
                ASSERT_EQ(eachList.firstCamera().node(), seen.node) << "frame " << frame;
                std::vector<ObjectId> all = allByWalking(tree.scene());
                many += all.size() > 1;
                all.push_back({});
                for (std::size_t i = 0; i < all.size(); ++i)
                    ASSERT_EQ(eachList.firstCamera().numbered(tree.scene(), i), all[i]) << "frame " << frame;
                if (seen.node) {
                    ASSERT_TRUE(sameBits(eachList.view(tree.scene()).value(), seen)) << "frame " << frame;
                }
                (seen.node ? cameras : none) += 1;
                changes += seen.node != std::exchange(last, seen.node);
            }
            // As the frame loop does: once per frame, with what the frame's lists were packed into.
            if (const CommittedFrame closed = tree.committer.closeFrame(); closed.list)
                eachFrame.update(tree.scene(), closed.list.get());
            ASSERT_EQ(eachFrame.firstCamera().node(), eachList.firstCamera().node()) << "frame " << frame;
            fresh.update(tree.scene(), nullptr);
            ASSERT_EQ(fresh.node(), eachList.firstCamera().node()) << "frame " << frame;
        }
        std::size_t bearers = 0;
        for (const ObjectId id : tree.scene().ids())
            if (const Node* node = tree.scene().get<Node>(id)) bearers += tree.scene().coreOf<Camera>(*node) != nullptr;
        several += bearers > 2;
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(cameras, 1000u);
    EXPECT_GT(none, 100u);
    EXPECT_GT(several, 15u);
    EXPECT_GT(changes, 200u);
    EXPECT_GT(many, 200u);
}

TEST(ViewSource, TheNamedNodeIsTheOneThatTheSceneSaysAfterAnyHistory) {
    std::size_t there = 0, missing = 0, cameras = 0;
    std::uint64_t searches = 0, lists = 0;
    forSeeds(30, [&](Random& random) {
        for (const char* path : {"/a", "/b/cam", "/a[1]/a", "/stage[1]", "/a//b", "#7", "/[1]"}) {
            RandomTree tree(random);
            NamedNode node(path);
            node.update(tree.scene(), nullptr);
            ViewSource view(oneScreen(), path);
            for (int step = 0; step < 200; ++step) {
                const ChangeListPtr list = tree.next();
                if (!list) continue;
                ++lists;
                node.update(tree.scene(), list.get());
                view.update(tree.scene(), list.get());
                const Expected<ObjectId> right = findNode(tree.scene(), path);
                ASSERT_EQ(node.node().has_value(), right.has_value()) << path << ", step " << step;
                if (right) {
                    ASSERT_EQ(*node.node(), *right) << path << ", step " << step;
                } else {
                    ASSERT_EQ(node.node().error().message, right.error().message) << path << ", step " << step;
                }
                (right ? there : missing) += 1;
                const Camera* camera = right ? tree.scene().coreOf<Camera>(*tree.scene().get<Node>(*right)) : nullptr;
                const Expected<View> now = view.view(tree.scene());
                ASSERT_EQ(now.has_value(), camera != nullptr) << path << ", step " << step;
                if (!camera) continue;
                ++cameras;
                ASSERT_TRUE(sameBits(*now, {*right, worldTransform(tree.scene(), *right), camera->worldUnitsPerMetre}));
            }
            if (path[0] != '#') searches += node.searches();
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(there, 1000u);
    EXPECT_GT(missing, 1000u);
    EXPECT_GT(cameras, 100u);
    EXPECT_LT(searches, lists) << "it is not looked for after every list";
}

/// `count` boxes' worth of nodes, ten to a group, and a camera behind them all.
struct Field {
    Committer committer;
    std::vector<ObjectId> nodes, transforms;
    ObjectId camera, cameraNode;

    explicit Field(std::size_t count) {
        ListMaker make;
        ObjectId group;
        for (std::size_t i = 0; i < count; ++i) {
            if (i % 10 == 0) group = make.node("group", kRootNode);
            transforms.push_back(make.transform(Vec3d(double(i), 0, 0)));
            nodes.push_back(make.node("box", group, transforms.back()));
        }
        camera = make.create<Camera>();
        cameraNode = make.node("camera", make.node("mast", kRootNode, make.transform(Vec3d(0, 5, 0))), camera);
        const Committer::Applied applied = committer.apply(make.builder.take()).value();
        std::unordered_map<ObjectId, ObjectId> given(applied.ids.begin(), applied.ids.end());
        for (std::vector<ObjectId>* ids : {&nodes, &transforms})
            for (ObjectId& id : *ids) id = given.at(id);
        camera = given.at(camera);
        cameraNode = given.at(cameraNode);
        (void)committer.closeFrame();
    }
    [[nodiscard]] const Aspect& scene() const { return committer.scene(); }
    /// Nodes that a ViewSource looks at because of this list.
    std::uint64_t visitsOf(ViewSource& view, ChangeList list) {
        const std::uint64_t before = view.firstCamera().nodesVisited();
        const Committer::Applied applied = committer.apply(std::move(list)).value();
        view.update(scene(), applied.list.get());
        EXPECT_TRUE(view.view(scene()));
        return view.firstCamera().nodesVisited() - before;
    }
};

TEST(ViewSource, LooksAtNothingButTheWayToTheCameras) {
    Field field(2000);
    ViewSource view(oneScreen(), "");
    view.update(field.scene(), nullptr);
    ASSERT_EQ(view.firstCamera().node(), field.cameraNode);
    const std::uint64_t atStart = view.firstCamera().nodesVisited();
    EXPECT_GE(atStart, 2000u) << "the counter counts";
    for (int frame = 0; frame < 100; ++frame) EXPECT_TRUE(view.view(field.scene()));
    EXPECT_EQ(view.firstCamera().nodesVisited(), atStart) << "an idle frame";

    ChangeListBuilder moves;
    for (const ObjectId id : field.transforms)
        moves.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(1, 2, 3)));
    EXPECT_EQ(field.visitsOf(view, moves.take()), 0u) << "what moves beside it";
    ListMaker more;
    for (int i = 0; i < 50; ++i) more.node("more", kRootNode, more.transform(Vec3d::Ones()));
    EXPECT_EQ(field.visitsOf(view, more.builder.take()), 0u) << "what comes beside it";
    ChangeListBuilder gone;
    for (int i = 0; i < 50; ++i) {
        gone.detach(field.nodes[static_cast<std::size_t>(i)]);
        gone.destroy(field.nodes[static_cast<std::size_t>(i)]);
    }
    EXPECT_EQ(field.visitsOf(view, gone.take()), 0u) << "what goes beside it";
    ChangeListBuilder off;
    off.set(field.camera, typeOf<Camera>(), fieldId<&Camera::enabled>, false);
    EXPECT_LE(field.visitsOf(view, off.take()), 6u) << "the camera, its mast and the root, on the way up and down";
    EXPECT_FALSE(view.firstCamera().node());
}

TEST(ViewSource, ANamedCameraIsSoughtAgainOnlyWhereItsNameMayBeMeant) {
    Field field(200);
    NamedNode named("/mast/camera");
    named.update(field.scene(), nullptr);
    ASSERT_EQ(named.node().value(), field.cameraNode);
    const auto searchesOf = [&](ChangeList list) {
        const std::uint64_t before = named.searches();
        named.update(field.scene(), field.committer.apply(std::move(list)).value().list.get());
        return named.searches() - before;
    };
    ListMaker more;
    for (int i = 0; i < 50; ++i) more.node("more", kRootNode);
    EXPECT_EQ(searchesOf(more.builder.take()), 0u);
    ChangeListBuilder gone;
    gone.detach(field.nodes[3]);
    gone.destroy(field.nodes[3]);
    gone.set(field.nodes[4], typeOf<Node>(), fieldId<&Node::name>, std::string("renamed"));
    EXPECT_EQ(searchesOf(gone.take()), 0u);
    ListMaker same;
    same.node("mast", kRootNode);
    EXPECT_EQ(searchesOf(same.builder.take()), 1u);
    EXPECT_EQ(named.node().value(), field.cameraNode) << "the first of that name still";
}

TEST(ViewSource, WithoutACameraItFramesTheSceneAsItWasWhenFirstAsked) {
    Committer committer;
    ListMaker make;
    make.node("box", kRootNode, make.box(Vec3d(2, 2, 2)));
    ASSERT_TRUE(committer.apply(make.builder.take()));
    ViewSource view(oneScreen(), "");
    view.update(committer.scene(), nullptr);
    const View first = view.view(committer.scene()).value();
    ListMaker far;
    far.node("far", far.node("away", kRootNode, far.transform(Vec3d(100, 0, 0))), far.box(Vec3d(9, 9, 9)));
    view.update(committer.scene(), committer.apply(far.builder.take()).value().list.get());
    EXPECT_EQ(view.view(committer.scene())->position, first.position);
    ASSERT_TRUE(view.set(committer.scene(), {.reset = true}));
    EXPECT_NE(view.view(committer.scene())->position, first.position);
}

TEST(ViewSource, WhereThingsStandInMetresOfTheWallItBeginsAsTheWallsOwn) {
    Committer committer;
    ListMaker make;
    make.node("box", make.node("away", kRootNode, make.transform(Vec3d(100, 0, 0))), make.box(Vec3d(2, 2, 2)));
    ASSERT_TRUE(committer.apply(make.builder.take()));
    const auto expectOwn = [&](ViewSource& view) {
        const View now = view.view(committer.scene()).value();
        EXPECT_EQ(now.position, Vec3d(0, 0, 0));
        EXPECT_EQ(now.orientation.coeffs(), Quatd::Identity().coeffs());
        EXPECT_EQ(now.worldUnitsPerMetre, 1.0);
    };
    ViewSource placed(oneScreen(), "", FirstView::kOfWall), fitted(oneScreen(), "");
    for (ViewSource* view : {&placed, &fitted}) view->update(committer.scene(), nullptr);
    EXPECT_NE(fitted.view(committer.scene())->position, Vec3d(0, 0, 0));
    expectOwn(placed);
    ASSERT_TRUE(placed.set(committer.scene(), {.position = Vec3d(3, 4, 5)}));
    EXPECT_EQ(placed.view(committer.scene())->position, Vec3d(3, 4, 5));
    ASSERT_TRUE(placed.set(committer.scene(), {.reset = true}));
    expectOwn(placed);
    // A server that goes on from a journal stands as the one before it.
    ViewSource next(oneScreen(), "");
    next.update(committer.scene(), nullptr);
    next.goOnFrom(placed.state());
    expectOwn(next);
}

TEST(ViewSource, HeadsStandWhereTrackersSeeThemAndNothingOfItIsKept) {
    Committer committer;
    const Wall wall = loadWall(TESSERA_SOURCE_DIR "/deploy/walls/1x1.wall").value();
    ViewSource view(wall, "");
    view.update(committer.scene(), nullptr);
    const std::string user = wall.users.at(0).name;
    const Vec3d before = view.view(committer.scene())->users.at(0).position;
    const std::uint64_t version = view.version();
    const Quatd turned(Eigen::AngleAxisd(1, Vec3d::UnitY()));
    const auto shown = [&](double share, const Vec3d& place = Vec3d(0.5, 1.5, 1)) {
        const TrackedHead heads[] = {{.user = user, .position = place, .orientation = turned, .share = share},
                                     {.user = "nobody", .share = 1}};
        view.follow(heads);
        return view.view(committer.scene())->users.at(0);
    };
    EXPECT_EQ(shown(1).position, Vec3d(0.5, 1.5, 1));
    EXPECT_LT(shown(1).orientation.angularDistance(turned), 1e-12);
    EXPECT_LT((shown(0.5).position - (before + Vec3d(0.5, 1.5, 1)) / 2).norm(), 1e-12);
    EXPECT_NEAR(shown(0.5).orientation.angularDistance(turned), 0.5, 1e-9);
    EXPECT_EQ(shown(0).position, before);
    EXPECT_EQ(shown(1, Vec3d(1e6, 0, 0)).position, before) << "nobody is there";
    (void)shown(1);
    EXPECT_EQ(view.state().users.at(0).position, before);
    EXPECT_EQ(view.version(), version) << "a journal would write every frame";
    // By hand: where no tracker speaks.
    ASSERT_TRUE(view.set(committer.scene(), {.user = user, .head = before + Vec3d(0.1, 0, 0)}));
    EXPECT_EQ(view.view(committer.scene())->users.at(0).position, Vec3d(0.5, 1.5, 1));
    EXPECT_EQ(shown(0).position, before + Vec3d(0.1, 0, 0));
}

TEST(ViewSource, ANamedCameraThatIsNotThereOrIsNoneIsToldInWords) {
    Field field(1);
    ViewSource missing(oneScreen(), "/nowhere"), noCamera(oneScreen(), "/mast");
    for (ViewSource* view : {&missing, &noCamera}) view->update(field.scene(), nullptr);
    EXPECT_WORDS(missing.view(field.scene()).error().message);
    EXPECT_WORDS(noCamera.view(field.scene()).error().message);
}

/// A box that stands at so many metres, and no camera.
ChangeListPtr boxAt(Committer& committer, double x) {
    ListMaker make;
    make.node("box", make.node("place", kRootNode, make.transform(Vec3d(x, 0, 0))), make.box(Vec3d::Ones()));
    const Expected<Committer::Applied> applied = committer.apply(make.builder.take());
    return applied ? applied->list : nullptr;
}

TEST(ViewSource, AfterTheFirstViewBoundsAreFoundElsewhereAndTheWallStandsUntilThen) {
    Committer committer;
    int orders = 0;
    constexpr Sequence now{7};
    ViewSource here(oneScreen(), ""), elsewhere(oneScreen(), "");
    elsewhere.surveyElsewhere([&] {
        ++orders;
        return now;
    });
    const auto both = [&](ChangeListPtr list) {
        ASSERT_TRUE(list);
        here.update(committer.scene(), list.get());
        elsewhere.update(committer.scene(), list.get());
    };
    both(boxAt(committer, 5));
    const View first = elsewhere.view(committer.scene()).value();
    EXPECT_EQ(orders, 0) << "nobody waits for the first one";
    EXPECT_EQ(first.position, here.view(committer.scene()).value().position);
    both(boxAt(committer, 500));
    ASSERT_TRUE(here.set(committer.scene(), {.reset = true}));
    ASSERT_TRUE(elsewhere.set(committer.scene(), {.reset = true}));
    for (int i = 0; i < 3; ++i) EXPECT_EQ(elsewhere.view(committer.scene()).value().position, first.position);
    EXPECT_EQ(orders, 1);
    EXPECT_FALSE(elsewhere.homeKnown());
    // Somebody else's survey, of the scene as it was before the far box came, says nothing of where all of it is seen.
    elsewhere.surveyed({.box = {.lower = Vec3d(4, -1, -1), .upper = Vec3d(6, 1, 1)}}, Sequence{6});
    EXPECT_EQ(elsewhere.view(committer.scene()).value().position, first.position);
    EXPECT_EQ(orders, 2);
    elsewhere.surveyed(animatedBounds(committer.scene()), now);
    EXPECT_TRUE(elsewhere.homeKnown());
    const View second = elsewhere.view(committer.scene()).value();
    EXPECT_NE(second.position, first.position);
    EXPECT_EQ(second.position, here.view(committer.scene()).value().position);
    elsewhere.surveyed({}, now);  // nobody has ordered one
    EXPECT_EQ(elsewhere.view(committer.scene()).value().position, second.position);
}

/// Moves the node "place".
void moveTo(Committer& committer, ViewSource& view, const Vec3d& where) {
    const ObjectId place = findNode(committer.scene(), "/place").value();
    ChangeListBuilder builder;
    setField<&Transform::translation>(builder, committer.scene().get<Node>(place)->core, where);
    const Expected<Committer::Applied> applied = committer.apply(builder.take());
    ASSERT_TRUE(applied);
    view.update(committer.scene(), applied->list.get());
}

TEST(ViewSource, AStudioStandsBelowTheModelAsItWasWhereverThatGoes) {
    Committer committer;
    ViewSource plain(oneScreen(), ""), studio(oneScreen(), "", FirstView::kOfScene, Stage::kStudio),
        inMetres(oneScreen(), "", FirstView::kOfWall, Stage::kStudio);
    const ChangeListPtr list = boxAt(committer, 5);
    for (ViewSource* view : {&plain, &studio, &inMetres}) view->update(committer.scene(), list.get());
    EXPECT_FALSE(plain.view(committer.scene())->studio);
    const Studio below{.middle = Vec3d(5, -0.5, 0), .reach = std::sqrt(0.75)};
    const View first = studio.view(committer.scene()).value();
    ASSERT_TRUE(first.studio);
    EXPECT_EQ(first.studio->middle, below.middle);
    EXPECT_NEAR(first.studio->reach, below.reach, 1e-12);
    EXPECT_EQ(inMetres.view(committer.scene())->studio, first.studio);
    EXPECT_EQ(inMetres.view(committer.scene())->position, Vec3d(0, 0, 0));
    for (ViewSource* view : {&studio, &inMetres}) {
        moveTo(committer, *view, Vec3d(5, 3, 1));
        EXPECT_EQ(view->view(committer.scene())->studio, first.studio) << "it stays where the model stood";
        ASSERT_TRUE(view->set(committer.scene(), {.position = Vec3d(1, 2, 3)}));
        EXPECT_EQ(view->view(committer.scene())->studio, first.studio) << "whoever moves the wall";
    }
    // A wall that goes on from a journal has it too.
    ViewSource again(oneScreen(), "", FirstView::kOfScene, Stage::kStudio), plainAgain(oneScreen(), "");
    again.goOnFrom(studio.state());
    plainAgain.goOnFrom(studio.state());
    EXPECT_EQ(again.view(committer.scene())->studio, first.studio);
    EXPECT_FALSE(plainAgain.view(committer.scene())->studio);
    // Who goes back to see all of the scene gets one below it as it is now; of a wall in metres it stays.
    for (ViewSource* view : {&studio, &inMetres}) ASSERT_TRUE(view->set(committer.scene(), {.reset = true}));
    EXPECT_EQ(studio.view(committer.scene())->studio->middle, Vec3d(5, 2.5, 1));
    EXPECT_EQ(inMetres.view(committer.scene())->studio, first.studio);
}

}  // namespace
}  // namespace tessera
