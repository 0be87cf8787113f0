#include "tests/support/words/Words.h"
#include "tests/unit/replica/RenderHostFixture.h"

#include <random>
#include <thread>

namespace tessera {
namespace {

TEST_F(RenderHostTest, FollowsTheSceneAndReportsItsHash) {
    start();
    Aspect scene = makeBall();
    ASSERT_TRUE(perform(work::ApplySnapshot{snapshotOf(scene)}));
    const auto applied = next<outcome::Applied>();
    ASSERT_TRUE(applied);
    EXPECT_EQ(applied->sequence, 7_seq);
    EXPECT_EQ(applied->stateHash, scene.stateHash());

    ObjectId transform;
    for (const ObjectId id : scene.ids())
        if (scene.get<Transform>(id)) transform = id;
    ChangeListBuilder move;
    move.set(transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(0, 1.5, -2)));
    const ChangeList list = move.take();
    ASSERT_TRUE(scene.apply(list));
    ASSERT_TRUE(perform(work::Draw{beginOf(0_frame, share(encodeChangeList(list)))}));
    const auto drawn = next<outcome::Drawn>();
    ASSERT_TRUE(drawn);
    EXPECT_EQ(drawn->stateHash, scene.stateHash());
    const auto stats = decodeStats(drawn->stats);
    ASSERT_TRUE(stats);
    ASSERT_EQ(stats->tiles.size(), 1u);
    const TileStats& tile = stats->tiles.front();
    EXPECT_EQ(tile.tile, "front-0-0");
    EXPECT_EQ(tile.drawn, 1u);
    EXPECT_GT(tile.trianglesDrawn, 500u);
    EXPECT_GT(tile.drawMs, 0);
    EXPECT_GT(stats->applyMs, 0);
    EXPECT_GE(stats->workMs, stats->applyMs + tile.cullMs + tile.drawMs) << "its parts lie in it";
    EXPECT_GE(stats->applyMs, stats->applyQueuedMs);
}

TEST_F(RenderHostTest, ShowsItsImageAgainWithoutDrawingWhileNothingItShowsChanges) {
    start({.output = folder_.path()});
    test::TestScene made;
    const ObjectId material = made.add(Material{});
    const ObjectId ball = made.place(made.add(makeSphere(0.8, 24), material), {-0.6, 1.5, -1});
    const ObjectId behind = made.place(made.add(makeSphere(0.8, 24)), {0, 1.5, 50});
    Aspect scene = made.take();
    ASSERT_TRUE(applied(scene));
    const auto shown = [&] { return readSharedFrame(folder_ / "tiles/front-0-0/shown.frame").value(); };
    const auto poseOf = [&](ObjectId node) { return scene.get<Node>(scene.get<Node>(node)->parent)->core; };
    const auto set = [](ObjectId id, ObjectType type, FieldId field, const FieldValue& value) {
        ChangeListBuilder list;
        list.set(id, type, field, value);
        return list.take();
    };

    const TileStats first = frame(FrameNumber(0));
    EXPECT_GT(first.drawMs, 0);
    const Picture picture = shown().picture;
    for (std::uint64_t number = 1; number < 5; ++number) {
        const TileStats idle = frame(FrameNumber(number));
        EXPECT_EQ(idle.cullMs + idle.drawMs, 0) << "frame " << number;
        EXPECT_EQ(idle.drawn, first.drawn);
        EXPECT_EQ(idle.trianglesDrawn, first.trianglesDrawn);
        EXPECT_EQ(shown().frame, number);
        EXPECT_EQ(shown().picture, picture);
    }
    const TileStats renamed =
        frame(FrameNumber(5), set(ball, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("ball"))));
    EXPECT_EQ(renamed.cullMs + renamed.drawMs, 0) << "a name is not seen";
    ChangeList compacted;  // of objects that came and went
    compacted.nextFreeId = 5'000;
    ASSERT_TRUE(scene.apply(compacted));
    EXPECT_EQ(frame(FrameNumber(5), compacted).cullMs, 0) << "no snapshot: nothing is to be known anew";
    const TileStats unseen = frame(FrameNumber(6), set(poseOf(behind), typeOf<Transform>(),
                                                       fieldId<&Transform::translation>, toValue(Vec3d(1, 1.5, 50))));
    EXPECT_GT(unseen.cullMs, 0);
    EXPECT_EQ(unseen.drawMs, 0) << "what this tile does not show";
    EXPECT_EQ(shown().picture, picture);
    EXPECT_EQ(shown().frame, 6u);
    // What only the renderer knows of.
    EXPECT_GT(
        frame(FrameNumber(7), set(material, typeOf<Material>(), fieldId<&Material::roughness>, toValue(0.1f))).drawMs,
        0);
    EXPECT_FALSE(shown().picture == picture);
    EXPECT_EQ(frame(FrameNumber(8)).drawMs, 0);
    View view;
    view.position = {0.1, 0, 0};
    EXPECT_GT(frame(FrameNumber(9), {}, view).drawMs, 0);
    EXPECT_EQ(frame(FrameNumber(10), {}, view).drawMs, 0);
    ASSERT_TRUE(applied(scene));
    EXPECT_GT(frame(FrameNumber(11), {}, view).drawMs, 0);
    configure(oneTileEach());
    EXPECT_GT(frame(FrameNumber(12), {}, view).drawMs, 0);
}

/// Whoever shows pictures needs nothing of the draw thread, which may draw for a neighbour meanwhile.
TEST_F(RenderHostTest, WhatIsDrawnIsShownByWhomItIsHandedTo) {
    start({.output = folder_.path()});
    Aspect scene = makeBall();
    ASSERT_TRUE(applied(scene));
    const auto shown = [&] { return readSharedFrame(folder_ / "tiles/front-0-0/shown.frame").value(); };
    (void)frame(FrameNumber(0));
    const Picture before = shown().picture;
    View view;
    view.position = {0.3, 0, 0};
    ASSERT_TRUE(perform(work::Draw{beginOf(1_frame, {}, view)}));
    const auto drawn = next<outcome::Drawn>();
    ASSERT_TRUE(drawn);
    ASSERT_EQ(drawn->pictures.size(), 1u);
    EXPECT_EQ(shown().picture, before);
    std::thread session([&] { show(*drawn); });
    (void)perform(work::Help{});
    session.join();
    EXPECT_EQ(shown().frame, 1u);
    const Picture after = shown().picture;
    EXPECT_NE(after, before);
    // Until the draw thread hears of it, what is asked of it is what was shown before; and that stays whole.
    ASSERT_TRUE(perform(work::SendImages{{.request = 5, .frame = 0_frame}}));
    const auto image = next<outcome::Image>();
    ASSERT_TRUE(image);
    EXPECT_EQ(image->image.frame, 0_frame);
    EXPECT_EQ(decodePng(image->image.picture.bytes())->picture, before);
    EXPECT_TRUE(host_->again({Attempt{3}, work::Shown{1_frame}}));
    ASSERT_TRUE(perform(work::SendImages{{.request = 6, .frame = 0_frame}}));
    EXPECT_EQ(decodePng(next<outcome::Image>()->image.picture.bytes())->picture, after);
    // The next one is drawn where nobody looks.
    view.position = {0.6, 0, 0};
    ASSERT_TRUE(perform(work::Draw{beginOf(2_frame, {}, view)}));
    ASSERT_TRUE(next<outcome::Drawn>());
    EXPECT_EQ(shown().picture, after);
}

TEST_F(RenderHostTest, DoesAtOnceOnlyWhatIsTheFrameBeforeOnceMore) {
    start({.output = folder_.path()});
    Aspect scene = makeBall();
    ASSERT_TRUE(applied(scene));
    const auto shown = [&] { return readSharedFrame(folder_ / "tiles/front-0-0/shown.frame").value(); };
    const auto again = [&](decltype(Work::what) what) { return host_->again({Attempt{3}, std::move(what)}); };
    EXPECT_FALSE(again(work::Draw{beginOf(0_frame)})) << "nothing is drawn yet";
    const TileStats first = frame(FrameNumber(0));
    EXPECT_FALSE(again(work::Draw{beginOf(1_frame)})) << "drawn, but not seen to stand still";
    const TileStats second = frame(FrameNumber(1));
    const Picture picture = shown().picture;
    for (std::uint64_t number = 2; number < 6; ++number) {
        const auto drawn = again(work::Draw{beginOf(FrameNumber(number))});
        ASSERT_TRUE(drawn);
        EXPECT_EQ(drawn->attempt, Attempt{3});
        const auto& said = std::get<outcome::Drawn>(drawn->what);
        EXPECT_EQ(said.frame, FrameNumber(number));
        EXPECT_EQ(said.stateHash, scene.stateHash());
        EXPECT_EQ(decodeStats(said.stats)->tiles.front(), second);
        EXPECT_EQ(shown().frame, number - 1) << "not before Show";
        show(said);
        EXPECT_TRUE(again(work::Shown{FrameNumber(number)}));
        EXPECT_EQ(shown().frame, number);
        EXPECT_EQ(shown().picture, picture);
    }
    EXPECT_FALSE(outcomes_.tryPop());
    View view;
    view.position = {0.1, 0, 0};
    EXPECT_FALSE(again(work::Draw{beginOf(6_frame, {}, view)})) << "another view";
    ChangeList list;
    list.nextFreeId = 5'000;
    EXPECT_FALSE(again(work::Draw{beginOf(6_frame, share(encodeChangeList(list)))})) << "a list";
    const auto drawn = again(work::Draw{beginOf(6_frame)});
    ASSERT_TRUE(drawn);
    ASSERT_TRUE(perform(work::SendImages{{.request = 1, .frame = 7_frame}}));
    show(std::get<outcome::Drawn>(drawn->what));
    EXPECT_FALSE(again(work::Shown{6_frame})) << "somebody waits for images";
    ASSERT_TRUE(perform(work::Shown{6_frame}));
    EXPECT_EQ(shown().frame, 6u);
    configure(oneTileEach());
    EXPECT_FALSE(again(work::Draw{beginOf(7_frame)})) << "another wall";
    EXPECT_GT(frame(FrameNumber(7)).drawMs, 0);
    EXPECT_GT(first.drawMs, 0);
}

TEST_F(RenderHostTest, WithoutASurfaceTakesPartInEveryFrameAndHasNoPictures) {
    host_ = std::make_unique<RenderHost>(RenderHostOptions{.name = "left", .output = folder_.path()}, nullptr, store_,
                                         log_, [this](Outcome outcome) { outcomes_.push(std::move(outcome)); });
    EXPECT_EQ(host_->probe().value(), 0u);
    configure(oneTileEach());
    Aspect scene = makeBall();
    ASSERT_TRUE(perform(work::ApplySnapshot{snapshotOf(scene)}));
    EXPECT_EQ(next<outcome::Applied>()->stateHash, scene.stateHash());
    ASSERT_TRUE(perform(work::Draw{beginOf(0_frame)}));
    const auto drawn = next<outcome::Drawn>();
    ASSERT_TRUE(drawn);
    EXPECT_EQ(drawn->stateHash, scene.stateHash());
    EXPECT_TRUE(drawn->pictures.empty());
    ASSERT_TRUE(perform(work::Shown{0_frame}));
    // And then at once, as any host does it whose pictures stay.
    EXPECT_TRUE(host_->again({Attempt{1}, work::Draw{beginOf(1_frame)}}));
    EXPECT_TRUE(host_->again({Attempt{1}, work::Shown{1_frame}}));
    // Whoever asks for pictures hears at once that there are none.
    ASSERT_TRUE(perform(work::SendImages{{.request = 9, .frame = 5_frame}}));
    const auto image = next<outcome::Image>();
    ASSERT_TRUE(image);
    EXPECT_EQ(image->image.request, 9u);
    EXPECT_TRUE(image->image.picture.empty());
    EXPECT_FALSE(perform(work::Finish{}));
    EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/tiles"));
}

TEST_F(RenderHostTest, LeavesToItsOwnThreadWhatMayWait) {
    start(
        {.output = folder_.path(), .keepFrames = true, .injection = {.kind = Injection::Kind::kDrawSlow, .frame = 4}});
    Aspect scene = makeBall();
    ASSERT_TRUE(applied(scene));
    for (std::uint64_t number = 0; number < 2; ++number) frame(FrameNumber(number));
    EXPECT_TRUE(host_->again({Attempt{1}, work::Draw{beginOf(2_frame)}}));
    EXPECT_FALSE(host_->again({Attempt{1}, work::Shown{2_frame}})) << "the disk may be behind";
    ASSERT_TRUE(perform(work::Shown{2_frame}));
    EXPECT_TRUE(host_->again({Attempt{1}, work::Draw{beginOf(3_frame)}}));
    EXPECT_FALSE(host_->again({Attempt{1}, work::Draw{beginOf(4_frame)}})) << "a fault to be injected";
}

TEST_F(RenderHostTest, ShowsWhatOneShowsWhoHasJustComeAfterAnyEdit) {
    start({.output = folder_.path()});
    std::mt19937 random(11);
    const auto pick = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
    test::TestScene made;
    const std::vector<std::uint8_t> red{255, 0, 0, 255}, blue{0, 0, 255, 255};
    const ObjectId image = made.addImage(Blob::of(std::span(red)), 1, 1);
    Material painted;
    painted.baseColorImage = image;
    const ObjectId materials[] = {made.add(Material{}), made.add(painted)};
    const MeshArrays meshes[] = {makeSphere(0.5, 12).toArrays(), makeBox({0.6, 0.9, 0.6}).toArrays()};
    std::vector<ObjectId> cores, nodes;
    for (int i = 0; i < 6; ++i) {
        cores.push_back(made.add(meshes[i % 2], materials[i % 2]));
        nodes.push_back(made.place(cores.back(), {0.7 * i - 2.2, 1.5, -1}));
    }
    made.addPointLight({0, 2, 1}, Vec3f::Ones(), 3);
    Aspect scene = made.take();
    ObjectId lamp;
    for (const ObjectId id : scene.ids())
        if (scene.get<PointLight>(id)) lamp = id;
    ASSERT_TRUE(applied(scene));
    const auto surface = test::pooledSurface();
    const auto renderer = Renderer::create(*surface, {.samples = 1}).value();
    const Wall wall = oneTileEach();
    const Tile tile = tilesOf(wall, "left").front();
    int again = 0;
    for (std::uint64_t number = 0; number < 120; ++number) {
        ChangeListBuilder edit;
        const ObjectId node = nodes[pick(nodes.size())];
        const ObjectId group = scene.get<Node>(node)->parent;
        const ObjectId core = scene.get<Node>(node)->core;
        switch (pick(11)) {
            case 0:
                edit.set(scene.get<Node>(group)->core, typeOf<Transform>(), fieldId<&Transform::translation>,
                         toValue(Vec3d(static_cast<double>(pick(5)) - 2, 1.5, -1)));
                break;
            case 1:
                edit.place(group, scene.get<Node>(group)->parent ? ObjectId() : kRootNode);
                break;
            case 2:
                edit.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(cores[pick(cores.size())]));
                break;
            case 3:
                edit.set(core, typeOf<Geometry>(), fieldId<&Geometry::material>, toValue(materials[pick(2)]));
                break;
            case 4: {
                const MeshArrays& mesh = meshes[pick(2)];
                edit.set(core, typeOf<Geometry>(), fieldId<&Geometry::positions>, toValue(mesh.positions));
                edit.set(core, typeOf<Geometry>(), fieldId<&Geometry::normals>, toValue(mesh.normals));
                edit.set(core, typeOf<Geometry>(), fieldId<&Geometry::indices>, toValue(mesh.indices));
                edit.set(core, typeOf<Geometry>(), fieldId<&Geometry::texcoords>, toValue(mesh.texcoords));
                break;
            }
            case 5:
                edit.set(materials[pick(2)], typeOf<Material>(), fieldId<&Material::baseColor>,
                         toValue(Vec4f(1, static_cast<float>(pick(2)), 1, pick(2) ? 1.0f : 0.5f)));
                break;
            case 6:
                edit.set(materials[pick(2)], typeOf<Material>(), fieldId<&Material::doubleSided>, true);
                break;
            case 7:
                edit.set(image, typeOf<Image>(), fieldId<&Image::pixels>,
                         toValue(Blob::of(std::span(pick(2) ? red : blue))));
                break;
            case 8:
                edit.set(lamp, typeOf<PointLight>(), fieldId<&PointLight::intensity>, toValue(pick(2) ? 3.0f : 2.0f));
                break;
            default:
                break;
        }
        const ChangeList list = edit.take();
        ASSERT_TRUE(scene.apply(list));
        again += frame(FrameNumber(number), list).drawMs == 0 ? 1 : 0;

        RenderScene anew;
        anew.update(scene, nullptr);
        const ScreenCamera camera = tileCamera(wall, tile, View{});
        const DrawList drawn = RenderAction(CullerKind::kNone).run(anew, camera, tile.rect, nullptr);
        const auto expected = renderer->draw(scene, drawn, camera, tile.rect);
        ASSERT_TRUE(expected);
        const auto shown = readSharedFrame(folder_ / "tiles/front-0-0/shown.frame");
        ASSERT_TRUE(shown);
        ASSERT_EQ(shown->frame, number);
        ASSERT_EQ(shown->picture, *expected) << "frame " << number;
    }
    EXPECT_GT(again, 20);
    EXPECT_LT(again, 100);
}

TEST_F(RenderHostTest, ShowsAnImageOnlyWhenTold) {
    start({.output = folder_.path()});
    Aspect scene = makeBall();
    ASSERT_TRUE(applied(scene));
    const std::string path = folder_ / "tiles/front-0-0/shown.frame";
    ASSERT_TRUE(perform(work::Draw{beginOf(0_frame)}));
    const auto drawn = next<outcome::Drawn>();
    ASSERT_TRUE(drawn);
    EXPECT_FALSE(readSharedFrame(path));
    show(*drawn);
    const auto shown = readSharedFrame(path);
    ASSERT_TRUE(shown);
    EXPECT_EQ(shown->frame, 0u);
    EXPECT_EQ(shown->picture.widthPx, 64);
    const std::set<std::uint8_t> shades(shown->picture.rgb.begin(), shown->picture.rgb.end());
    EXPECT_GT(shades.size(), 20u) << "there is a ball in it";

    ASSERT_TRUE(perform(work::Shown{0_frame}));
    EXPECT_FALSE(perform(work::Finish{}));
    const auto png = readFile(folder_ / "tiles/front-0-0/000000.png", 1'000'000);
    ASSERT_TRUE(png);
    const auto decoded = decodePng(*png);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->frame, 0u);
    EXPECT_EQ(decoded->picture, shown->picture);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "tiles/front-1-0")) << "another host's tile";
}

TEST_F(RenderHostTest, KeepsEveryShownFrameWhenAsked) {
    start({.output = folder_.path(), .keepFrames = true});
    for (const FrameNumber frame : {0_frame, 1_frame, 2_frame}) drawAndShow(frame);
    ASSERT_TRUE(perform(work::Draw{beginOf(3_frame)}));  // drawn, never shown
    EXPECT_FALSE(perform(work::Finish{}));
    for (const char* name : {"000000.png", "000001.png", "000002.png"})
        EXPECT_TRUE(std::filesystem::exists(folder_ / ("tiles/front-0-0/" + std::string(name)))) << name;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "tiles/front-0-0/000003.png"));
}

TEST_F(RenderHostTest, SendsImagesOnceALateEnoughFrameIsShown) {
    start();
    drawAndShow(4_frame);
    ASSERT_TRUE(perform(work::SendImages{{.request = 11, .frame = 5_frame}}));
    ASSERT_TRUE(perform(work::SendImages{{.request = 12, .frame = 4_frame}}));
    const auto now = next<outcome::Image>();
    ASSERT_TRUE(now);
    EXPECT_EQ(now->image.request, 12u);
    EXPECT_EQ(now->image.frame, 4_frame);
    EXPECT_EQ(now->image.tile, "front-0-0");
    EXPECT_TRUE(decodePng(now->image.picture));
    drawAndShow(5_frame);
    const auto later = next<outcome::Image>();
    ASSERT_TRUE(later);
    EXPECT_EQ(later->image.request, 11u);
    EXPECT_EQ(later->image.frame, 5_frame);
}

TEST_F(RenderHostTest, DescribesItsStateDownToTheObject) {
    start({.injection = *parseInjection("corrupt@1")});
    Aspect scene = makeBall();
    ASSERT_TRUE(applied(scene));
    drawAndShow(0_frame);
    ASSERT_TRUE(perform(work::Draw{beginOf(1_frame)}));
    const auto drawn = next<outcome::Drawn>();
    ASSERT_TRUE(drawn);
    EXPECT_NE(drawn->stateHash, scene.stateHash()) << "one field differs now";

    ASSERT_TRUE(perform(work::Describe{{.objects = true, .leaf = 0}}));
    const auto described = next<outcome::Described>();
    ASSERT_TRUE(described);
    EXPECT_EQ(described->answer.sequence, 7_seq);
    std::vector<std::uint64_t> differing;
    const std::vector<Aspect::ObjectHash> expected = scene.objectHashes(0);
    ASSERT_EQ(described->answer.entries.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i)
        if (described->answer.entries[i].hash != expected[i].hash) differing.push_back(expected[i].id.value);
    ASSERT_EQ(differing.size(), 1u);
    EXPECT_NE(scene.get<Transform>(ObjectId{differing.front()}), nullptr);

    ASSERT_TRUE(perform(work::ApplySnapshot{snapshotOf(scene)}));
    const auto repaired = next<outcome::Applied>();
    ASSERT_TRUE(repaired);
    EXPECT_EQ(repaired->stateHash, scene.stateHash());
}

TEST_F(RenderHostTest, SaysWhatCannotBeAppliedAndStaysAlive) {
    start();
    ASSERT_TRUE(perform(work::ApplySnapshot{{share(CommittedList{1_seq, {}, Bytes(40, std::byte{0xff}), {}})}}));
    EXPECT_TRUE(next<outcome::ApplyFailed>());
    ChangeListBuilder impossible;
    impossible.destroy(ObjectId{77});
    ASSERT_TRUE(
        perform(work::ApplyChanges{{share(CommittedList{2_seq, {}, encodeChangeList(impossible.take()), {}})}}));
    const auto failed = next<outcome::ApplyFailed>();
    ASSERT_TRUE(failed);
    EXPECT_WORDS(failed->reason);
    ASSERT_TRUE(perform(work::Draw{{.frame = 0_frame, .payload = share(Bytes(9, std::byte{0xff}))}}));
    EXPECT_TRUE(next<outcome::ApplyFailed>());
    drawAndShow(0_frame);
}

TEST_F(RenderHostTest, LeavesWhenItCannotDraw) {
    start({.injection = *parseInjection("draw-fail@2")});
    drawAndShow(1_frame);
    EXPECT_FALSE(perform(work::Draw{beginOf(2_frame)}));
    const auto broken = next<outcome::Broken>();
    ASSERT_TRUE(broken);
    EXPECT_WORDS(broken->error.message);
}

/// Drawn into a file or not: small pictures of what is shown, and of what shows the same nothing but that.
TEST_F(RenderHostTest, WhatShowsTheSameIsNotSentSmallAgain) {
    for (const bool toFile : {false, true}) {
        start(toFile ? RenderHostOptions{.output = folder_.path()} : RenderHostOptions{});
        Aspect ball = makeBall();
        ASSERT_TRUE(applied(ball));
        drawAndShow(5_frame);
        const auto ask = [&](FrameNumber frame, std::uint32_t shrink, bool news) -> message::TileImage {
            EXPECT_TRUE(perform(work::SendImages{{.request = 7, .frame = frame, .shrink = shrink, .news = news}}));
            const auto image = next<outcome::Image>();
            EXPECT_TRUE(image);
            return image ? image->image : message::TileImage();
        };
        const message::TileImage first = ask(5_frame, 2, true);
        EXPECT_FALSE(first.same);
        ASSERT_GT(first.picture.size(), 2u);
        EXPECT_EQ(first.picture.bytes()[0], std::byte{0xff}) << "a JPEG";
        EXPECT_EQ(first.picture.bytes()[1], std::byte{0xd8});
        EXPECT_TRUE(ask(5_frame, 2, true).same);
        drawAndShow(6_frame);  // nothing has changed
        EXPECT_TRUE(ask(6_frame, 2, true).same);
        EXPECT_FALSE(ask(6_frame, 4, true).same) << "another size";
        EXPECT_EQ(ask(6_frame, 2, false).picture, first.picture) << "whoever has nothing asks for all";
        View view;
        view.position = {0.3, 0, 0};
        ASSERT_TRUE(perform(work::Draw{beginOf(7_frame, {}, view)}));
        const auto drawn = next<outcome::Drawn>();
        ASSERT_TRUE(drawn);
        show(*drawn);
        ASSERT_TRUE(perform(work::Shown{7_frame}));
        const message::TileImage other = ask(7_frame, 2, true);
        EXPECT_FALSE(other.same);
        EXPECT_FALSE(other.picture == first.picture);
        EXPECT_EQ(other.frame, 7_frame);
    }
}

TEST_F(RenderHostTest, LeavesWhenTheWallMakesNoSense) {
    start();
    EXPECT_FALSE(perform(work::Configure{.configuration = Bytes(20, std::byte{0xff})}));
    EXPECT_TRUE(next<outcome::Broken>());
}

/// Whoever is told of the first one holds the writer up: the draw thread is asked for more all the same, and never
/// waits.
TEST_F(RenderHostTest, ManyWhoWantPicturesKeepNobodyWaiting) {
    start({.output = folder_.path()});
    Aspect ball = makeBall();
    ASSERT_TRUE(applied(ball));
    drawAndShow(5_frame);
    std::promise<void> gate;
    onOutcome_ = [opened = gate.get_future().share()](const Outcome& outcome) {
        const auto* image = std::get_if<outcome::Image>(&outcome.what);
        if (image && !image->image.picture.empty()) opened.wait();
    };
    for (std::uint64_t i = 0; i < 64; ++i)
        ASSERT_TRUE(perform(work::SendImages{{.request = 100 + i, .frame = 5_frame}}));
    // Other pictures: as many as there is room for, the others are none at once.
    for (std::uint64_t i = 0; i < 20; ++i) {
        ASSERT_TRUE(perform(work::Draw{beginOf(FrameNumber(6 + i))}));
        const auto drawn = next<outcome::Drawn>();
        ASSERT_TRUE(drawn);
        show(*drawn);
        ASSERT_TRUE(perform(work::Shown{FrameNumber(6 + i)}));
        ASSERT_TRUE(perform(work::SendImages{{.request = 200 + i, .frame = FrameNumber(6 + i)}}));
        while (auto none = outcomes_.tryPop()) EXPECT_TRUE(std::get<outcome::Image>(none->what).image.picture.empty());
    }
    gate.set_value();
    std::set<const std::byte*> encoded;
    for (int i = 0; i < 64; ++i) {
        const auto image = next<outcome::Image>();
        ASSERT_TRUE(image);
        ASSERT_FALSE(image->image.picture.empty());
        EXPECT_EQ(image->image.request, 100u + static_cast<unsigned>(i));
        encoded.insert(image->image.picture.bytes().data());
    }
    EXPECT_LE(encoded.size(), 2u) << "one for the first, one for those who came while that was told";
}

TEST_F(RenderHostTest, KeepsItsImageThroughANewConnection) {
    start();
    drawAndShow(8_frame);
    configure(oneTileEach());
    ASSERT_TRUE(perform(work::SendImages{{.request = 1, .frame = 0_frame}}));
    const auto kept = next<outcome::Image>();
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->image.frame, 8_frame);
    // A wall with other tiles: what was shown is of no use.
    configure(oneTileEach(70));
    ASSERT_TRUE(perform(work::SendImages{{.request = 2, .frame = 0_frame}}));
    drawAndShow(9_frame);
    const auto fresh = next<outcome::Image>();
    ASSERT_TRUE(fresh);
    EXPECT_EQ(fresh->image.request, 2u);
    EXPECT_EQ(fresh->image.frame, 9_frame);
}

TEST_F(RenderHostTest, SaysWhenPicturesCannotBeWritten) {
    ASSERT_TRUE(writeFile(folder_ / "file", asBytes("x")));
    start({.output = folder_ / "file"});
    EXPECT_FALSE(perform(work::Draw{beginOf(0_frame)}));
    const auto broken = next<outcome::Broken>();
    ASSERT_TRUE(broken);
    EXPECT_WORDS(broken->error.message);
}

/// Nothing that could be counted as still.
TEST_F(RenderHostTest, WithoutASurfaceItSaysNothingOfTiles) {
    RenderHostOptions options;
    options.name = "left";
    host_ = std::make_unique<RenderHost>(options, nullptr, store_, log_,
                                         [this](Outcome outcome) { outcomes_.push(std::move(outcome)); });
    ASSERT_TRUE(host_->probe());
    configure(oneTileEach());
    Aspect ball = makeBall();
    ASSERT_TRUE(applied(ball));
    for (std::uint64_t number = 1; number < 4; ++number) {
        ASSERT_TRUE(performOrAgain(work::Draw{beginOf(FrameNumber{number})}));
        const auto drawn = next<outcome::Drawn>();
        ASSERT_TRUE(drawn);
        const auto stats = decodeStats(drawn->stats);
        ASSERT_TRUE(stats);
        EXPECT_TRUE(stats->tiles.empty());
    }
}

}  // namespace
}  // namespace tessera
