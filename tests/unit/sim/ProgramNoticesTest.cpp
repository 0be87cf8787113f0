/// What the wall says of bad programs: comes, stands where it can be read, goes, and is nobody's but the server's.
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/cores/Switch.h"
#include "server/programs/ProgramNotices.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/drawable/SceneBounds.h"
#include "common/scene/Action.h"
#include "common/scene/Edits.h"
#include "common/scene/ServerNodes.h"
#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/NoticeShop.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::Shop;

TEST(ProgramNotices, ComeAndGoWithVerdicts) {
    Shop shop(3);
    shop.frames();
    EXPECT_EQ(shop.lists, 0) << "while nothing is wrong there is nothing to say";
    const std::size_t objects = shop.scene().objectCount();
    shop.verdict(1, SurfaceProgram::kBad, "surface, line 2: no");
    ASSERT_EQ(shop.texts().size(), 1u) << "one, though two things have it";
    EXPECT_EQ(shop.texts()[0].text,
              "/thing1/box: SurfaceProgram #" + std::to_string(shop.programs[1].value) + "\nsurface, line 2: no");
    EXPECT_FALSE(shop.texts()[0].outlines.empty()) << "letters travel as outlines";
    const int once = shop.lists;
    shop.frames(50);
    EXPECT_EQ(shop.lists, once) << "and it is said once";
    shop.verdict(0, SurfaceProgram::kBad, "surface, line 9: nor this");
    ASSERT_EQ(shop.texts().size(), 2u);
    shop.verdict(1, SurfaceProgram::kBad, "surface, line 3: still not");
    EXPECT_WORDS(shop.texts()[1].text);
    shop.verdict(1, SurfaceProgram::kGood);
    shop.verdict(0, SurfaceProgram::kUntried);
    EXPECT_FALSE(shop.top());
    EXPECT_EQ(shop.scene().objectCount(), objects) << "nothing is left";
    EXPECT_EQ(shop.simulation.history().undoDepth(), 0u);
}

TEST(ProgramNotices, SayWhatIsHeavyToo) {
    Shop shop(2);
    shop.frames();
    shop.verdict(1, SurfaceProgram::kHeavy, "it held up host left");
    ASSERT_EQ(shop.texts().size(), 1u);
    EXPECT_EQ(shop.texts()[0].text,
              "/thing1/box: SurfaceProgram #" + std::to_string(shop.programs[1].value) + "\nit held up host left");
    shop.verdict(1, SurfaceProgram::kGood);
    EXPECT_FALSE(shop.top());
}

/// A cube comes, and goes: by the uniform, by the image's shape, with the program.
TEST(ProgramNotices, SayWhenAProgramIsGivenWhatItCannotRead) {
    Shop shop(2);
    shop.frames();
    const auto edit = [&](ChangeListBuilder& list) {
        shop.frame(test::one(list.take()));
        shop.frames();
    };
    const auto box = findNode(shop.scene(), "/thing1/box").value();
    const ObjectId material = shop.scene().coreOf<Geometry>(*shop.scene().get<Node>(box))->material;
    ListMaker make;
    const ObjectId image = make.create<Image>(), uniform = make.create<Uniform>();
    setField<&Image::shape>(make.builder, image, Image::kCube);
    setField<&Uniform::name>(make.builder, uniform, std::string("sky"));
    setField<&Uniform::image>(make.builder, uniform, image);
    setField<&Material::uniforms>(make.builder, material, RefList{uniform});
    edit(make.builder);
    EXPECT_FALSE(shop.top()) << "no sampler is called so";
    ChangeListBuilder text;
    setField<&SurfaceProgram::surface>(
        text, shop.scene().get<Material>(material)->program,
        std::string("uniform sampler2D // of the sky\n sky; void surface(inout Surface s) {}"));
    edit(text);
    ASSERT_EQ(shop.texts().size(), 1u);
    const std::string said = shop.texts()[0].text;
    EXPECT_TRUE(said.starts_with("/thing1/box: Material #" + std::to_string(material.value))) << said;
    EXPECT_WORDS(said);
    ObjectId shown;
    for (const ObjectId id : shop.scene().ids())
        if (shop.scene().get<Image>(id)) shown = id;
    ChangeListBuilder list;
    setField<&Image::shape>(list, shown, Image::kFlat);
    edit(list);
    EXPECT_FALSE(shop.top()) << "a flat one";
    setField<&Image::shape>(list, shown, Image::kSolid);
    edit(list);
    ASSERT_EQ(shop.texts().size(), 1u);
    EXPECT_WORDS(shop.texts()[0].text);
    setField<&Material::program>(list, material, ObjectId());
    edit(list);
    EXPECT_FALSE(shop.top()) << "nobody reads it";
}

TEST(ProgramNotices, GoWithWhatTheyAreOfOrMoveToTheNextOfIt) {
    Shop shop;
    shop.verdict(0, SurfaceProgram::kBad, "no");
    const auto remove = [&](const char* path) {
        shop.frame(test::one(*removalList(shop.scene(), findNode(shop.scene(), path).value())));
    };
    remove("/thing0/box");
    shop.frame();
    ASSERT_EQ(shop.texts().size(), 1u);
    EXPECT_TRUE(shop.texts()[0].text.starts_with("/thing0/twin: "));
    remove("/thing0");
    shop.frame();
    EXPECT_FALSE(shop.top());
    shop.frame(test::one(Edit::Kind::kUndo));
    shop.frames();
    EXPECT_EQ(shop.texts().size(), 1u) << "what comes back is still wrong";
    // What is not seen needs no words: the thing hangs below a Switch that shows nothing.
    ListMaker make;
    const ObjectId off = make.create<Switch>();
    setField<&Switch::choice>(make.builder, off, Switch::kNone);
    const ObjectId hidden = make.node("hidden", kRootNode, off);
    make.builder.place(findNode(shop.scene(), "/thing0").value(), hidden);
    shop.frame(test::one(make.builder.take()));
    shop.frames();
    EXPECT_FALSE(shop.top());
}

/// Where the reader stands, how large the thing is: between the eye and the thing, and about as high on the screen.
TEST(ProgramNotices, StandWhereTheyCanBeRead) {
    forSeeds(100, [](Random& random) {
        const auto uniform = [&](double low, double high) {
            return low + (high - low) * static_cast<double>(below(random, 100'001)) / 1e5;
        };
        Shop shop;
        shop.frame();
        ChangeListBuilder list;
        const ObjectId core = test::transformAt(shop.scene(), "/thing0");
        const double size = std::pow(10.0, uniform(-2, 3));
        const Vec3d middle(uniform(-5, 5), uniform(-5, 5), uniform(-5, 5));
        setField<&Transform::translation>(list, core, middle);
        setField<&Transform::scale>(list, core, Vec3d(size, size * uniform(0.1, 1), size * uniform(0.1, 1)));
        shop.frame(test::one(list.take()));
        shop.view.worldUnitsPerMetre = std::pow(10.0, uniform(-1, 2));
        shop.verdict(0, SurfaceProgram::kBad, "surface, line 1: a complaint of some length that goes on");
        for (int i = 0; i < 5; ++i) {
            shop.view.position = Vec3d(uniform(-20, 20), uniform(-20, 20), uniform(-20, 20)) * size;
            shop.frames(3);
            const Vec3d eye = shop.view.world_T_wall() * shop.wall.users.front().position;
            const Node& notice = *shop.scene().get<Node>(shop.scene().get<Node>(shop.top())->children[0]);
            const Transform& stands = *shop.scene().coreOf<Transform>(notice);
            const Vec3d to = stands.translation - eye, way = middle - eye;
            const bool within = way.norm() < size;
            if (!within) {
                EXPECT_LT(to.norm(), way.norm() * 1.0001) << "before the thing";
            }
            // A thing that one stands in may be anywhere about one.
            if (way.norm() > 2 * size) {
                EXPECT_GT(to.normalized().dot(way.normalized()), 0.7);
            }
            const double height = 1.0 / 2.4;  // of the screen, seen from 2.4 m
            const double share = stands.scale.x() / std::max(to.norm(), 0.05 * shop.view.worldUnitsPerMetre) / height;
            EXPECT_GT(share, 1.0 / 80);
            EXPECT_LT(share, 1.0 / 20);
        }
        const int lists = shop.lists;
        for (int i = 0; i < 30; ++i) {  // a head that trembles
            shop.view.position.x() +=
                std::min(1e-4 * size, 2e-3 * shop.view.worldUnitsPerMetre) * (i % 2 == 0 ? 1 : -1);
            shop.frame();
        }
        EXPECT_LE(shop.lists, lists + 2);
    });
}

/// As the first user's eye sees them on the screen: whole, and none before another, as long as there is room: between n
/// of a height h there is in any case where the screen is higher than 2 n - 1 of them, with a tenth around each.
TEST(ProgramNotices, CoverNoneOfEachOther) {
    int judged = 0;
    forSeeds(300, [&](Random& random) {
        const auto uniform = [&](double low, double high) {
            return low + (high - low) * static_cast<double>(below(random, 100'001)) / 1e5;
        };
        const std::size_t count = 2 + below(random, 3);
        Shop shop(count);
        shop.frame();
        const Screen& screen = shop.wall.screens.front();
        ChangeListBuilder list;
        for (std::size_t i = 0; i < count; ++i) {
            // On the screen, crowded or not, before it or behind it.
            const Vec3d on = screen.lowerLeft + uniform(0.02, 0.98) * (screen.lowerRight - screen.lowerLeft) +
                             uniform(0.4, i % 2 == 0 ? 0.6 : 0.98) * (screen.upperLeft - screen.lowerLeft);
            const Vec3d head = shop.wall.users.front().position, at = head + uniform(0.6, 4) * (on - head);
            const ObjectId core = test::transformAt(shop.scene(), "/thing" + std::to_string(i));
            setField<&Transform::translation>(list, core, at);
            setField<&Transform::scale>(list, core, Vec3d::Constant(uniform(0.05, 0.3)).eval());
        }
        shop.frame(test::one(list.take()));
        for (std::size_t i = 0; i < count; ++i)
            shop.verdict(i, SurfaceProgram::kBad,
                         std::string(1 + below(random, count == 2 ? 60 : 10), 'w') + " what it says");
        shop.frames();
        ASSERT_TRUE(shop.top());
        std::vector<Box> seen;
        for (const Shop::SeenPlate& plate : shop.plates()) seen.push_back(plate.onScreen);
        ASSERT_EQ(seen.size(), count);
        double tallest = 0;
        for (const Box& box : seen) tallest = std::max(tallest, 1.25 * box.size().y());
        const bool roomy = static_cast<double>(2 * count - 1) * tallest < screen.heightMetres();
        judged += roomy;
        const double slack = 0.03 * screen.heightMetres();  // turned to the eye they are no rectangles on the screen
        for (std::size_t i = 0; i < count; ++i) {
            EXPECT_GT(seen[i].lower.y(), -slack);
            EXPECT_LT(seen[i].upper.y(), screen.heightMetres() + slack);
            EXPECT_GT(seen[i].lower.x(), -3 * slack);
            EXPECT_LT(seen[i].upper.x(), screen.widthMetres() + 3 * slack);
            for (std::size_t j = 0; roomy && j < i; ++j) {
                const Vec3d lower = seen[i].lower.cwiseMax(seen[j].lower),
                            upper = seen[i].upper.cwiseMin(seen[j].upper);
                EXPECT_FALSE(upper.x() - lower.x() > slack && upper.y() - lower.y() > slack) << i << " and " << j;
            }
        }
    });
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(judged, 100);
    }
}

/// Eyes in things, right before them, and beside what reaches only some of the screen; walls that lean and turn, and go
/// on to do so.
TEST(ProgramNotices, AreOnTheFirstScreenBeforeWhatReachesIt) {
    int inside = 0, before = 0, off = 0;
    forSeeds(200, [&](Random& random) {
        const auto uniform = [&](double low, double high) {
            return low + (high - low) * static_cast<double>(below(random, 100'001)) / 1e5;
        };
        const auto direction = [&]() -> Vec3d {
            return Vec3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized();
        };
        Shop shop;
        const bool stereo = oneIn(random, 3);
        if (stereo) shop.wall.hosts.front().tiles.front().eye = Eye::kLeft;
        shop.notices = ProgramNotices(shop.wall);
        shop.notices.update(shop.scene(), nullptr);
        const Screen& screen = shop.wall.screens.front();
        shop.frame();
        shop.view.worldUnitsPerMetre = std::pow(10.0, uniform(-1, 2));
        const double unit = shop.view.worldUnitsPerMetre;
        const ObjectId core = test::transformAt(shop.scene(), "/thing0");
        shop.verdict(0, SurfaceProgram::kBad,
                     "surface, line 1: a complaint of some length that goes on for more than a line of it");
        for (int i = 0; i < 6; ++i) {
            shop.view.position = 50 * unit * direction();
            shop.view.orientation = Quatd(Eigen::AngleAxisd(uniform(-3, 3), Vec3d::UnitY()) *
                                          Eigen::AngleAxisd(uniform(-0.5, 0.5), Vec3d::UnitX()));
            // A box from a finger's to a hall's size, the eye in it or up to its size away from it; it may reach around
            // the eye.
            const Vec3d size =
                unit * std::pow(10.0, uniform(-1, 1.5)) * Vec3d(uniform(0.2, 1), uniform(0.2, 1), uniform(0.2, 1));
            const double apart = oneIn(random, 2) ? uniform(0, 0.49) : uniform(0.51, 1.5);
            Vec3d towards = direction();
            towards /= towards.cwiseAbs().maxCoeff();
            const Vec3d middle = shop.eye() + apart * size.cwiseProduct(towards);
            const Box box{middle - 0.5 * size, middle + 0.5 * size};
            ChangeListBuilder list;
            setField<&Transform::translation>(list, core, box.center());
            setField<&Transform::scale>(list, core, size);
            shop.frame(test::one(list.take()));
            shop.frames(3);
            const std::vector<Shop::SeenPlate> plates = shop.plates();
            ASSERT_EQ(plates.size(), 1u);
            // Is any place of it seen, well within the screen?
            const Affine3d wall_T_world = shop.view.world_T_wall().inverse();
            const Vec3d head = shop.view.users.front().position;
            bool reaches = box.contains(shop.eye());
            for (int k = 0; k < 400 && !reaches; ++k) {
                const Vec3d way =
                    wall_T_world *
                        Vec3d(box.lower + size.cwiseProduct(Vec3d(uniform(0, 1), uniform(0, 1), uniform(0, 1)))) -
                    head;
                const double depth = screen.lowerLeft.z() - head.z();
                const Vec3d on = head + depth / way.z() * way - screen.lowerLeft;
                const Vec3d rest = Vec3d(screen.widthMetres(), screen.heightMetres(), 0) - on;
                reaches = way.z() < -0.06 && std::min({on.x(), on.y(), rest.x(), rest.y()}) > 0.02;
            }
            if (!reaches) {
                ++off;
                continue;
            }
            const Shop::SeenPlate& plate = plates.front();
            EXPECT_GT(plate.least, 0.05) << "before the near plane";
            const double slack = 0.005;
            EXPECT_GT(plate.onScreen.lower.x(), -slack);
            EXPECT_GT(plate.onScreen.lower.y(), -slack);
            EXPECT_LT(plate.onScreen.upper.x(), screen.widthMetres() + slack);
            EXPECT_LT(plate.onScreen.upper.y(), screen.heightMetres() + slack);
            EXPECT_GT(plate.onScreen.size().x(), 0.1 * screen.widthMetres()) << "letters that can be read";
            // What is free before it is room enough, or it is right before the eye.
            const double free = (shop.eye() - shop.eye().cwiseMax(box.lower).cwiseMin(box.upper)).norm() / unit;
            EXPECT_LT(plate.most, std::max(free, stereo ? 0.7 : 0.3));
            (free == 0 ? inside : before) += 1;
        }
    });
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(inside, 300);
        EXPECT_GT(before, 100);
        EXPECT_GT(off, 50);
    }
}

TEST(ProgramNotices, AreBoundedInNumberAndInWork) {
    Shop shop(40);
    ChangeListBuilder list;
    for (const ObjectId id : shop.programs) setField<&SurfaceProgram::verdict>(list, id, SurfaceProgram::kBad);
    shop.frame(test::one(Edit{.ticket = 9, .list = list.take(), .undoable = false}));
    shop.frame();
    ASSERT_EQ(shop.texts().size(), ProgramNotices::kMost);
    EXPECT_WORDS(shop.texts().back().text);
    // A tree that changes in every frame is looked at every tenth, by whoever looks for what nothing has: each walk
    // goes further.
    Shop other;
    ChangeListBuilder bare;
    setField<&Geometry::material>(bare, other.scene().get<Node>(findNode(other.scene(), "/thing0/box").value())->core,
                                  ObjectId());
    other.frame(test::one(bare.take()));
    other.verdict(0, SurfaceProgram::kBad, "no");
    EXPECT_FALSE(other.top());
    std::size_t walks = 0;
    for (int i = 0; i < 100; ++i) {
        ListMaker make;
        (void)make.node("more", kRootNode);
        const std::size_t before = other.notices.visited();
        other.frame(test::one(make.builder.take()));
        walks += other.notices.visited() != before ? 1 : 0;
    }
    EXPECT_LE(walks, 11u);
    EXPECT_GE(walks, 8u);
}

TEST(ProgramNotices, MakeNoSceneLargerAndAreNobodysObstacle) {
    Shop shop;
    shop.frames(2);
    const Box bare = sceneBounds(shop.scene());
    shop.verdict(0, SurfaceProgram::kBad, "no");
    ASSERT_FALSE(shop.seen().empty());
    EXPECT_EQ(sceneBounds(shop.scene()).lower, bare.lower);
    EXPECT_EQ(sceneBounds(shop.scene()).upper, bare.upper);
    // Dragged right through it.
    ListMaker make;
    const ObjectId interest = make.create<Interest>();
    setField<&Interest::object>(make.builder, interest, findNode(shop.scene(), "/thing0").value());
    setField<&Interest::response>(make.builder, interest, Interest::kStop);
    (void)make.node("interest", kRootNode, interest);
    shop.frame(test::one(make.builder.take()));
    const Vec3d through = shop.seen().center();
    shop.frame(test::one(test::moveTo(test::transformAt(shop.scene(), "/thing0"), through)));
    EXPECT_EQ(test::placeOf(shop.scene(), "/thing0"), through);
}

/// Nobody's edit gets at it (ServersNodes); what an older journal or a server's own list has left is made good, and
/// what hangs there stays.
TEST(ProgramNotices, WhateverHasBecomeOfThemIsMadeGood) {
    Shop shop(2);
    shop.verdict(0, SurfaceProgram::kBad, "no");
    const Box first = shop.seen();
    const auto asItWas = [&] {
        shop.frames(3);
        return shop.top() && shop.texts().size() == 1 && (shop.seen().center() - first.center()).norm() < 1e-9;
    };
    const auto notice = [&] { return shop.scene().get<Node>(shop.top())->children[0]; };
    const auto become = [&](ChangeList list) {
        shop.frame(test::one(Edit{.ticket = 9, .list = std::move(list), .undoable = false}));
    };
    ChangeListBuilder list;
    setField<&Transform::translation>(list, shop.scene().get<Node>(notice())->core, Vec3d(7, 7, 7));
    become(list.take());
    EXPECT_TRUE(asItWas());
    become(*removalList(shop.scene(), notice()));
    EXPECT_TRUE(asItWas());
    become(*removalList(shop.scene(), shop.top()));
    EXPECT_TRUE(asItWas());
    const ObjectId earlier = shop.top();
    setField<&Node::name>(list, earlier, std::string("away"));
    become(list.take());
    EXPECT_TRUE(asItWas());
    setField<&Node::name>(list, earlier, std::string(kProgramNoticesName));  // there are two of them now
    become(list.take());
    EXPECT_TRUE(asItWas());
    EXPECT_EQ(
        std::ranges::count_if(shop.scene().ids(), [&](ObjectId id) { return shop.scene().get<Text>(id) != nullptr; }),
        1);
    ListMaker make;
    (void)make.node("hat", notice(), make.box(Vec3d(0.1, 0.1, 0.1)));
    become(make.builder.take());
    EXPECT_TRUE(asItWas());
    EXPECT_TRUE(findNode(shop.scene(), "/hat"));
    // Something else of that name is left alone.
    ListMaker other;
    (void)other.node(std::string(kProgramNoticesName), kRootNode, other.box(Vec3d(1, 1, 1)));
    shop.frame(test::one(other.builder.take()));
    EXPECT_TRUE(asItWas());
    shop.verdict(0, SurfaceProgram::kGood);
    EXPECT_TRUE(findNode(shop.scene(), "/" + std::string(kProgramNoticesName)));
    EXPECT_FALSE(shop.top());
}

/// A server that goes on from its journal has the scene and remembers nothing else.
TEST(ProgramNotices, WhoGoesOnFromAJournalFindsThem) {
    Shop shop(2);
    shop.verdict(0, SurfaceProgram::kBad, "no");
    const ObjectId top = shop.top();
    shop.notices = ProgramNotices(shop.wall);
    shop.notices.update(shop.scene(), nullptr);
    shop.frames();
    EXPECT_EQ(shop.top(), top) << "the same ones";
    EXPECT_EQ(shop.texts().size(), 1u);
    shop.verdict(0, SurfaceProgram::kGood);
    EXPECT_FALSE(shop.top());
}

/// Random edits of programs, things, the tree and the view: after a while what is shown is what a fresh start shows.
TEST(ProgramNotices, WhatHasFollowedSaysWhatAFreshStartSays) {
    forSeeds(100, [](Random& random) {
        Shop shop(4);
        for (int i = 0; i < 40; ++i) {
            const std::size_t which = below(random, 4);
            const std::string path = "/thing" + std::to_string(which);
            const bool there = findNode(shop.scene(), path).has_value();
            switch (below(random, 6)) {
                case 0:
                    if (!shop.scene().get<SurfaceProgram>(shop.programs[which]))
                        break;  // gone with the last that it was of
                    shop.verdict(which, static_cast<std::int64_t>(below(random, 3)),
                                 "problem " + std::to_string(below(random, 3)));
                    break;
                case 1:
                    if (there)
                        shop.frame(test::one(test::moveTo(test::transformAt(shop.scene(), path),
                                                          Vec3d(static_cast<double>(below(random, 9)), 0, -5))));
                    break;
                case 2:
                    if (there && oneIn(random, 3))
                        shop.frame(test::one(*removalList(shop.scene(), findNode(shop.scene(), path).value())));
                    break;
                case 3:
                    if (shop.simulation.history().undoDepth() > 0) shop.frame(test::one(Edit::Kind::kUndo));
                    break;
                case 4: {
                    ListMaker make;
                    (void)make.node("more", kRootNode);
                    shop.frame(test::one(make.builder.take()));
                    break;
                }
                default:
                    shop.view.position.x() = static_cast<double>(below(random, 5));
                    shop.frame();
            }
            if (::testing::Test::HasFailure()) return;
        }
        shop.frames();
        std::vector<std::string> followed, anew;
        for (const Text& text : shop.texts()) followed.push_back(text.text);
        shop.notices = ProgramNotices(shop.wall);
        shop.notices.update(shop.scene(), nullptr);
        shop.frames();
        for (const Text& text : shop.texts()) anew.push_back(text.text);
        EXPECT_EQ(followed, anew);
        EXPECT_EQ(shop.scene().root().children[shop.scene().root().children.size() - 1] == shop.top(),
                  shop.top().value != 0);
    });
}

}  // namespace
}  // namespace tessera
