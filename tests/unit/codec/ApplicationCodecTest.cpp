#include "common/codec/ApplicationCodec.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "common/request/Check.h"
#include "tests/support/words/Words.h"
#include "tests/unit/codec/Samples.h"

namespace tessera {
namespace {

using namespace test;

/// Encoding is deterministic and complete (the fields are compared one by one below), so equal bytes mean equal values.
TEST(ApplicationCodec, EverythingSaidIsHeardAsItWas) {
    ASSERT_EQ(everyRequest().size(), std::variant_size_v<ApplicationRequest>);
    ASSERT_EQ(everyAnswer().size(), std::variant_size_v<ApplicationAnswer>);
    ASSERT_EQ(everyNotice().size(), std::variant_size_v<ApplicationNotice>);
    for (const auto& value : everyRequest()) {
        const auto back = decodeRequest(encodeRequest(value));
        ASSERT_TRUE(back) << value.index() << ": " << back.error().message;
        EXPECT_EQ(back->index(), value.index());
        EXPECT_EQ(encodeRequest(*back), encodeRequest(value)) << value.index();
    }
    for (const auto& value : everyAnswer()) {
        const auto back = decodeAnswer(encodeAnswer(value));
        ASSERT_TRUE(back) << value.index() << ": " << back.error().message;
        EXPECT_EQ(back->index(), value.index());
        EXPECT_EQ(encodeAnswer(*back), encodeAnswer(value)) << value.index();
    }
    for (const auto& value : everyNotice()) {
        const auto back = decodeNotice(encodeNotice(value));
        ASSERT_TRUE(back) << value.index() << ": " << back.error().message;
        EXPECT_EQ(back->index(), value.index());
        EXPECT_EQ(encodeNotice(*back), encodeNotice(value)) << value.index();
    }
}

TEST(ApplicationCodec, WhatIsSaidOfTrackersKeepsItsFields) {
    const auto trackers = std::get<answer::Trackers>(*decodeAnswer(encodeAnswer(everyAnswer()[12]))).trackers;
    ASSERT_EQ(trackers.size(), 1u);
    EXPECT_EQ(trackers[0].address, "0.0.0.0:5000");
    EXPECT_EQ(trackers[0].trouble, "cut");
    EXPECT_EQ(
        trackers[0].datagrams + 10 * trackers[0].strangers + 100 * trackers[0].malformed + 1000 * trackers[0].tooMany,
        4321u);
    ASSERT_EQ(trackers[0].sensors.size(), 1u);
    const SensorInfo& sensor = trackers[0].sensors[0];
    EXPECT_EQ(sensor.sensor + "," + sensor.moves, "body 0,head viewer");
    EXPECT_EQ(sensor.poses + 10 * sensor.refused + 100 * sensor.buttons, 965u);
    EXPECT_EQ(std::vector({sensor.rateHz, sensor.ageMs, sensor.straysMm}), (std::vector{60.5, 7.5, 0.25}));
    const auto poses = std::get<notice::Poses>(*decodeNotice(encodeNotice(everyNotice()[6])));
    EXPECT_EQ(poses.frame, 41_frame);
    ASSERT_EQ(poses.heads.size(), 1u);
    EXPECT_TRUE(poses.heads[0].tracked && poses.heads[0].poses == 42 && poses.heads[0].user == "viewer");
    EXPECT_EQ(poses.heads[0].position, Vec3d(1, 2, 3));
    EXPECT_EQ(poses.heads[0].orientation.coeffs(), Quatd(0.5, 0.5, -0.5, 0.5).coeffs());
    ASSERT_EQ(poses.wands.size(), 1u);
    const WandState& wand = poses.wands[0];
    EXPECT_TRUE(wand.tracked && wand.poses == 43 && wand.buttons == 5 && wand.name == "right");
    EXPECT_EQ(wand.position, Vec3d(4, 5, 6));
    EXPECT_EQ(wand.worldPosition, Vec3d(7, 8, 9));
    EXPECT_EQ(wand.worldOrientation.y(), 1);
    EXPECT_EQ(wand.axes, (std::vector{0.5, -1.0}));
    EXPECT_EQ(std::get<request::PickAt>(*decodeRequest(encodeRequest(request::PickAt{{.wand = "right"}}))).aim.wand,
              "right");
    EXPECT_TRUE(std::get<request::SubscribeNews>(*decodeRequest(encodeRequest(request::SubscribeNews{{.poses = true}})))
                    .wanted.poses);
    EXPECT_EQ(
        std::get<answer::Status>(*decodeAnswer(encodeAnswer(answer::Status{.trackers = {"art: dtrack"}}))).trackers,
        std::vector<std::string>{"art: dtrack"});
}

TEST(ApplicationCodec, WhatIsSaidOfTheSceneKeepsItsFields) {
    const auto objects = std::get<answer::Objects>(*decodeAnswer(encodeAnswer(everyAnswer()[10])));
    EXPECT_EQ(objects.sequence, 34_seq);
    EXPECT_EQ(objects.objects, twoObjects());
    EXPECT_EQ(objects.content, *some(60));
    const auto page = std::get<answer::TreePage>(*decodeAnswer(encodeAnswer(everyAnswer()[11])));
    EXPECT_EQ(page.nodes, std::get<answer::TreePage>(everyAnswer()[11]).nodes);
    EXPECT_EQ(page.next, std::vector{ObjectId{1}});
    EXPECT_TRUE(page.lengths.empty());
    const answer::TreePage films{.lengths = {{ObjectId{9}, 2.5}, {ObjectId{7}, 0.25}}};
    EXPECT_EQ(std::get<answer::TreePage>(*decodeAnswer(encodeAnswer(films))).lengths, films.lengths);
    EXPECT_FALSE(decodeAnswer(
        encodeAnswer(answer::TreePage{.lengths = {{ObjectId{9}, std::numeric_limits<double>::quiet_NaN()}}})));
    const auto named = std::get<request::GetObjects>(*decodeRequest(encodeRequest(everyRequest()[14]))).wish;
    EXPECT_EQ(named.names, (std::vector<std::string>{"/hall/crane", "#17"}));
    EXPECT_TRUE(!named.paths && named.content);
    const auto tree = std::get<request::GetTree>(*decodeRequest(encodeRequest(everyRequest()[15]))).wish;
    EXPECT_EQ(tree.node, ObjectId{3});
    EXPECT_EQ(tree.levels, 4u);
    EXPECT_EQ(tree.after, (std::vector{ObjectId{3}, ObjectId{9}}));
    EXPECT_EQ(tree.coreType, ObjectType{5});
    EXPECT_EQ(tree.cores, (std::vector{ObjectId{6}, ObjectId{7}}));
    EXPECT_EQ(std::get<request::RemoveNode>(*decodeRequest(encodeRequest(everyRequest()[16]))).node, ObjectId{8});
    const auto clone = std::get<request::CloneNode>(*decodeRequest(encodeRequest(everyRequest()[20]))).wish;
    EXPECT_EQ(clone.node, ObjectId{11});
    EXPECT_EQ(clone.under, ObjectId{12});
    EXPECT_TRUE(clone.name == "twin" && clone.deep);
    EXPECT_EQ(clone.shareTypes, std::vector{ObjectType{5}});
    EXPECT_EQ(clone.shareObjects, (std::vector{ObjectId{13}, ObjectId{14}}));
    const auto find = std::get<request::FindNodes>(*decodeRequest(encodeRequest(everyRequest()[21]))).wish;
    EXPECT_EQ(find.expression, "/hall/**/wheel*[visible]");
    EXPECT_EQ(find.node, ObjectId{3});
    EXPECT_EQ(find.coreType, ObjectType{4});
    EXPECT_EQ(find.pageSize, 17u);
    EXPECT_EQ(find.after, (std::vector{ObjectId{3}, ObjectId{9}}));
    const auto found = std::get<answer::FoundPage>(*decodeAnswer(encodeAnswer(everyAnswer()[13])));
    EXPECT_EQ(found.sequence, 36_seq);
    EXPECT_EQ(found.nodes, twoObjects());
    EXPECT_EQ(found.next, (std::vector{ObjectId{1}, ObjectId{5}}));
    EXPECT_EQ(found.lookedAt, 37u);
    EXPECT_EQ(std::get<answer::Committed>(*decodeAnswer(encodeAnswer(everyAnswer()[1]))).created, 26u);
    for (const Showing showing : {Showing::kScene, Showing::kTestPicture, Showing::kCountedTestPicture})
        EXPECT_EQ(std::get<request::ShowPicture>(*decodeRequest(encodeRequest(request::ShowPicture{showing}))).showing,
                  showing);
    EXPECT_EQ(decodeRequest(encodeRequest(request::ShowPicture{static_cast<Showing>(kLastShowing + 1)})).error().code,
              ErrorCode::kUnsupported);
    EXPECT_EQ(std::get<answer::Committed>(*decodeAnswer(encodeAnswer(everyAnswer()[1]))).removed, 25u);
}

TEST(ApplicationCodec, NamesAndPagesHaveLimits) {
    ObjectsWish many;
    many.names.assign(ApplicationLimits().maxNames + 1, "/hall");
    EXPECT_EQ(decodeRequest(encodeRequest(request::GetObjects{many})).error().code, ErrorCode::kLimit);
    CloneWish sharing;
    sharing.shareObjects.assign(ApplicationLimits().maxShared + 1, ObjectId{5});
    EXPECT_EQ(decodeRequest(encodeRequest(request::CloneNode{sharing})).error().code, ErrorCode::kLimit);
    TreeWish deep;
    deep.after.assign(ApplicationLimits().maxDepth + 1, ObjectId{1});
    EXPECT_EQ(decodeRequest(encodeRequest(request::GetTree{deep})).error().code, ErrorCode::kLimit);
    answer::TreePage page;
    page.nodes.assign(ApplicationLimits().maxPageNodes + 1, {});
    EXPECT_EQ(decodeAnswer(encodeAnswer(page)).error().code, ErrorCode::kLimit);
}

TEST(ApplicationCodec, ARequestKeepsItsFields) {
    const auto propose = std::get<request::ProposeChanges>(*decodeRequest(encodeRequest(everyRequest()[0])));
    EXPECT_EQ(propose.gesture, 4711u);
    EXPECT_EQ(propose.list, *some(300));
    ASSERT_EQ(propose.blobs.size(), 2u);
    EXPECT_TRUE(propose.blobs[0].empty());
    EXPECT_EQ(propose.blobs[1], *some(200));

    const auto load = std::get<request::LoadFile>(*decodeRequest(encodeRequest(everyRequest()[3])));
    EXPECT_EQ(load.path, "models/2CylinderEngine.glb");
    EXPECT_EQ(load.parent, ObjectId{17});
    EXPECT_EQ(load.placing.at, Vec3d(1, 2, 3));
    EXPECT_EQ(load.placing.scale, 0.5);
    EXPECT_FALSE(load.placing.fit);
    EXPECT_EQ(load.placing.up, UpAxis::kZ);
    EXPECT_EQ(load.placing.pointRadius, 0.25);
    EXPECT_EQ(load.variants, (std::vector<std::string>{"/Chair:color=red", "/Hall:light=night"}));
    EXPECT_TRUE(load.reload);

    const auto view = std::get<request::SetView>(*decodeRequest(encodeRequest(everyRequest()[4]))).wish;
    EXPECT_EQ(*view.position, Vec3d(1, 2, 3));
    EXPECT_EQ(view.orientation->coeffs(), Quatd(0.5, -0.5, 0.5, -0.5).coeffs());
    EXPECT_EQ(*view.worldUnitsPerMetre, 1000);
    EXPECT_EQ(view.user, "viewer");
    EXPECT_EQ(*view.head, Vec3d(0, 1.7, 2.4));
    EXPECT_TRUE(view.reset);

    const auto still = std::get<request::SetView>(*decodeRequest(encodeRequest(request::SetView{}))).wish;
    EXPECT_FALSE(still.position || still.orientation || still.worldUnitsPerMetre || still.head || still.reset)
        << "what is not set stays not set";

    const auto pick = std::get<request::PickAt>(*decodeRequest(encodeRequest(everyRequest()[5]))).aim;
    EXPECT_EQ(pick.xPx, 12.5);
    EXPECT_EQ(pick.yPx, -3);
    const auto subscribe = std::get<request::SubscribeNews>(*decodeRequest(encodeRequest(everyRequest()[8]))).wanted;
    EXPECT_TRUE(subscribe.contacts && !subscribe.picks && subscribe.frames);
}

TEST(ApplicationCodec, AnAnswerKeepsItsFields) {
    const auto answers = everyAnswer();
    const auto committed = std::get<answer::Committed>(*decodeAnswer(encodeAnswer(answers[1])));
    EXPECT_EQ(committed.sequence, Sequence{21});
    EXPECT_EQ(committed.ids, std::get<answer::Committed>(answers[1]).ids);
    EXPECT_EQ(committed.stopped, std::get<answer::Committed>(answers[1]).stopped);

    const auto status = std::get<answer::Status>(*decodeAnswer(encodeAnswer(answers[2])));
    EXPECT_EQ(status.wallName, "2x2");
    EXPECT_EQ(status.epoch, 11_epoch);
    EXPECT_EQ(status.frame, 12_frame);
    EXPECT_EQ(status.sequence, 13_seq);
    EXPECT_EQ(status.stateHash, StateHash(~0ull));
    ASSERT_EQ(status.hosts.size(), 2u);
    EXPECT_EQ(status.hosts[0].name, "lower-left");
    EXPECT_EQ(status.hosts[0].state, "live");
    EXPECT_EQ(status.hosts[0].lastShown, 14_frame);
    EXPECT_EQ(status.hosts[0].roundTripMs, 0.25);
    EXPECT_EQ(status.waitingFor, std::vector<std::string>{"lower-left"});
    EXPECT_EQ(status.redoDepth, 20u);
    EXPECT_EQ(status.journal, "/var/lib/wall");
    EXPECT_EQ(status.journalTrouble, "no space left");
    EXPECT_EQ(status.objects + status.nodes + status.undoDepth + status.applications, 16u + 17 + 18 + 19);

    const auto loaded = std::get<answer::Loaded>(*decodeAnswer(encodeAnswer(answers[3])));
    EXPECT_EQ(loaded.node, ObjectId{25});
    EXPECT_EQ(loaded.objects, 26u);
    EXPECT_EQ(loaded.triangles, 27u);
    EXPECT_TRUE(loaded.reloaded);
    EXPECT_EQ(loaded.changed + loaded.created + loaded.removed + loaded.kept, 28u + 29 + 30 + 31);

    const auto picked = std::get<answer::Picked>(*decodeAnswer(encodeAnswer(answers[4])));
    EXPECT_TRUE(picked.hit);
    EXPECT_EQ(picked.node, ObjectId{28});
    EXPECT_EQ(picked.face, 29u);
    EXPECT_EQ(picked.point, Vec3d(1, 2, 3));
    EXPECT_EQ(picked.xPx, 30.5);
    EXPECT_EQ(picked.yPx, 31.5);
    EXPECT_EQ(picked.t, 2.5);
    EXPECT_EQ(picked.normal, Vec3d(0, 0, 1));
    EXPECT_EQ(picked.corners, Vec2d(0.25, 0.5));
    EXPECT_EQ(picked.texcoord, Vec2d(0.125, 0.75));

    const auto contacts = std::get<answer::Contacts>(*decodeAnswer(encodeAnswer(answers[5])));
    EXPECT_EQ(contacts.frame, 100_frame);
    EXPECT_EQ(contacts.begun, 7u);
    ASSERT_EQ(contacts.contacts.size(), 2u);
    EXPECT_EQ(contacts.contacts[0].objectA, ObjectId{3});
    EXPECT_EQ(contacts.contacts[0].objectB, ObjectId{4});
    EXPECT_EQ(contacts.contacts[0].faceA, 5u);
    EXPECT_EQ(contacts.contacts[0].faceB, 6u);
    EXPECT_EQ(contacts.contacts[0].point, Vec3d(0.1, -2, 1e300));
    EXPECT_EQ(contacts.contacts[0].normal, Vec3d(0, 1, 0));

    const auto images = std::get<answer::Images>(*decodeAnswer(encodeAnswer(answers[6])));
    ASSERT_EQ(images.tiles.size(), 2u);
    EXPECT_EQ(images.tiles[1].tile, "front-1-0");
    EXPECT_EQ(images.tiles[1].host, "b");
    EXPECT_EQ(images.tiles[1].frame, 33_frame);
    EXPECT_EQ(images.tiles[1].png, *some(5));
    EXPECT_EQ(images.missing, std::vector<std::string>{"front-0-1"});
    EXPECT_TRUE(decodeAnswer(encodeAnswer(answer::Images{})));

    const auto frame = std::get<notice::Frame>(*decodeNotice(encodeNotice(everyNotice()[0])));
    EXPECT_EQ(frame.frame, 40_frame);
    EXPECT_EQ(frame.shown, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(frame.held, std::vector<std::string>{"c"});
}

TEST(ApplicationCodec, RefusesNumbersThatAreNone) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto refused = [](const ViewWish& view) { return !decodeRequest(encodeRequest(request::SetView{view})); };
    ViewWish view;
    view.position = Vec3d(0, nan, 0);
    EXPECT_TRUE(refused(view));
    view = {};
    view.orientation = Quatd(0, 0, 0, 0);
    EXPECT_TRUE(refused(view));
    view = {};
    view.worldUnitsPerMetre = 0;
    EXPECT_TRUE(refused(view));
    view.worldUnitsPerMetre = -1;
    EXPECT_TRUE(refused(view));
    EXPECT_FALSE(decodeRequest(encodeRequest(request::PickAt{{nan, 0, ""}})));
    answer::Contacts contacts = twoContacts();
    contacts.contacts[0].point.x() = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(decodeAnswer(encodeAnswer(contacts)));
}

TEST(ApplicationCodec, BoundsWhatItTakes) {
    EXPECT_FALSE(decodeRequest(encodeRequest(request::LoadFile{std::string(5000, 'x'), {}})));
    ApplicationLimits tight;
    tight.maxBlobs = 1;
    EXPECT_FALSE(decodeRequest(encodeRequest(everyRequest()[0]), tight));
    tight.maxContacts = 1;
    EXPECT_FALSE(decodeAnswer(encodeAnswer(twoContacts()), tight));
    tight.maxTiles = 1;
    EXPECT_FALSE(decodeAnswer(encodeAnswer(everyAnswer()[6]), tight));
    tight.maxHosts = 1;
    EXPECT_FALSE(decodeAnswer(encodeAnswer(everyAnswer()[2]), tight));
    EXPECT_FALSE(decodeNotice(encodeNotice(everyNotice()[0]), tight));
    EXPECT_FALSE(decodeRequest({})) << "nothing at all";
}

TEST(ApplicationCodec, WhatANewerVersionAsksIsRefusedInWords) {
    // Field 500 of the oneof, length-delimited, empty.
    Bytes bytes(8);
    bytes[0] = std::byte{3};
    for (const int b : {0xa2, 0x1f, 0x00}) bytes.push_back(static_cast<std::byte>(b));
    const auto request = decodeRequest(share(std::move(bytes)));
    ASSERT_FALSE(request);
    EXPECT_WORDS(request.error().message);
}

TEST(ApplicationCodec, WhatAnOlderProgramAsksIsRefusedInWords) {
    // A handle that is grabbed, as a program of protocol 15 before requests were described says it: field 24.
    Bytes bytes(8);
    bytes[0] = std::byte{5};
    for (const int b : {0xc2, 0x01, 0x02, 0x12, 0x00}) bytes.push_back(static_cast<std::byte>(b));
    const auto request = decodeRequest(share(std::move(bytes)));
    ASSERT_FALSE(request);
    EXPECT_EQ(request.error().code, ErrorCode::kUnsupported);
    EXPECT_EQ(request.error().message, "request 24 is no longer understood; take a newer program");
}

TEST(ApplicationCodec, WhatIsOutOfItsBoundsIsRefusedByItsName) {
    const auto refusal = [](const ApplicationRequest& request) {
        const auto decoded = decodeRequest(encodeRequest(request));
        return decoded ? std::string("taken") : decoded.error().message;
    };
    EXPECT_EQ(refusal(request::SetBudget{-3}), "SetBudget: milliseconds must be from 0.1 to 60000, or 0, not -3");
    EXPECT_EQ(refusal(request::SetBudget{0}), "taken");
    EXPECT_EQ(refusal(request::SetView{{.worldUnitsPerMetre = 0}}),
              "SetView: world_units_per_metre must be from 1e-09 to 1e+09, not 0");
    EXPECT_EQ(refusal(request::MoveNode{.move = {.scale = Vec3d(1, 0, 1)}}),
              "MoveNode: scale must be other than 0, not 0");
    EXPECT_EQ(refusal(request::NavigateView{{.deed = NavigationWish::Deed::kKeepBookmark, .bookmark = 10}}),
              "NavigateView: bookmark must be from 1 to 9, not 10");
    EXPECT_EQ(refusal(request::LoadFile{std::string(5000, 'x'), {}}),
              "LoadFile: path has 5000 bytes; at most 4096 are allowed");
    const auto said = checkRequest(request::SetBudget{-3});
    ASSERT_FALSE(said);
    EXPECT_EQ(said.error().message, refusal(request::SetBudget{-3})) << "who says it is told the same";
}

TEST(ApplicationCodec, NoBytesCrashIt) {
    std::mt19937 random(3);
    std::vector<Bytes> seeds;
    for (const auto& value : everyRequest()) seeds.push_back(encodeRequest(value));
    for (const auto& value : everyAnswer()) seeds.push_back(encodeAnswer(value));
    for (const auto& value : everyNotice()) seeds.push_back(encodeNotice(value));
    std::size_t accepted = 0;
    for (int round = 0; round < 10'000; ++round) {
        Bytes bytes = seeds[random() % seeds.size()];
        if (bytes.size() > 2000) bytes.resize(2000);
        for (unsigned n = random() % 5; n > 0; --n) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
        if (random() % 3 == 0) bytes.resize(random() % (bytes.size() + 1));
        const SharedBytes spoilt = share(std::move(bytes));
        if (const auto r = decodeRequest(spoilt)) accepted += decodeRequest(encodeRequest(*r)).has_value();
        if (const auto a = decodeAnswer(spoilt)) accepted += decodeAnswer(encodeAnswer(*a)).has_value();
        if (const auto n = decodeNotice(spoilt)) accepted += decodeNotice(encodeNotice(*n)).has_value();
    }
    EXPECT_GT(accepted, 1000u);
}

}  // namespace
}  // namespace tessera
