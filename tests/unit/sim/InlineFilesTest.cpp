/// Files of Inlines: where they may lie, cycles whatever they are called, and scenes whose content is there with the
/// first frame.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "common/base/Channel.h"
#include "common/cores/Inline.h"
#include "common/scene/Aspect.h"
#include "server/sim/StartScene.h"
#include "server/sim/commit/Committer.h"
#include "server/sim/frame/InlineContents.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

class InlineFiles : public testing::Test {
protected:
    /// What comes of one order.
    Preparation read(const std::string& file, std::vector<std::string> chain = {},
                     std::vector<std::string> allowed = {}, std::vector<std::string> scenes = {}) {
        return read(std::make_shared<SceneFiles>(importOptions(), std::move(allowed), std::move(scenes)), file,
                    std::move(chain));
    }
    Preparation read(std::shared_ptr<SceneFiles> files, const std::string& file, std::vector<std::string> chain = {}) {
        Channel<Preparation> finished(1);
        Loader loader(importOptions(), std::move(files), [&](Preparation done) { finished.push(std::move(done)); });
        EXPECT_TRUE(loader.order({.ticket = 1,
                                  .node = kRootNode,
                                  .path = file,
                                  .asked = false,
                                  .content = Preparation::Content{
                                      .core = ObjectId(40), .type = typeOf<Inline>(), .chain = std::move(chain)}}));
        return std::move(*finished.pop());
    }
    std::string trouble(const std::string& file, std::vector<std::string> chain = {},
                        std::vector<std::string> allowed = {}, std::vector<std::string> scenes = {}) {
        const Preparation made = read(file, std::move(chain), std::move(allowed), std::move(scenes));
        return made.refused ? made.refused->message : "";
    }
    /// The scene of these files, as it is before the first frame.
    Expected<Aspect> start(const std::vector<std::string>& paths) {
        return start(paths, std::make_shared<SceneFiles>(importOptions(), std::vector<std::string>(), paths));
    }
    Expected<Aspect> start(const std::vector<std::string>& paths, std::shared_ptr<SceneFiles> files) {
        Channel<Preparation> finished(8);
        Loader loader(importOptions(), std::move(files), [&](Preparation done) { finished.push(std::move(done)); });
        StartScene scene(paths);
        if (const Expected<void> ordered = scene.order(loader, 0); !ordered) return tl::unexpected(ordered.error());
        for (;;) {
            Expected<std::optional<std::vector<ChangeList>>> lists =
                scene.take(std::move(*finished.pop()), loader, log);
            if (!lists) return tl::unexpected(lists.error());
            if (!*lists) continue;
            Committer committer;
            for (ChangeList& list : **lists)
                if (const Expected<Committer::Applied> applied = committer.apply(std::move(list)); !applied)
                    return tl::unexpected(applied.error());
            Aspect copy;
            EXPECT_TRUE(copy.apply(snapshot(committer.scene())));
            return copy;
        }
    }
    /// Of all Inlines and ProxyGroups by the names of their nodes.
    static std::map<std::string, LoadWish> wishesOf(const Aspect& scene) {
        std::map<std::string, LoadWish> wishes;
        for (const ObjectId id : scene.ids())
            if (const Node* node = scene.get<Node>(id); node && node->core)
                if (const std::optional<LoadWish> wish = loadWishOf(scene.find(node->core)))
                    wishes[pathOf(scene, id)] = *wish;
        return wishes;
    }
    Scratch scratch;
    Log log{"inlines"};
};

constexpr const char* kBox = R"(node { name: "box" box { size { x: 1 y: 1 z: 1 } } })";

TEST_F(InlineFiles, LieWhereTheServerMayReadThem) {
    const std::string file = scratch.write("in/a.tsct", kBox);
    EXPECT_WORDS(trouble(file));
    EXPECT_EQ(trouble(file, {}, {scratch.path("in")}), "");
    EXPECT_WORDS(trouble(file, {}, {}, {scratch.path("in/scene.tsct")}));
    EXPECT_WORDS(trouble(file, {}, {}, {"/scene.tsct"}));
    EXPECT_WORDS(trouble("a.tsct", {}, {scratch.path("in")}));
    EXPECT_NE(trouble(scratch.path("in/none.tsct"), {}, {scratch.path("in")}), "");
    EXPECT_NE(trouble("asset://no such thing.glb"), "");
    scratch.write("in/bad.tsct", "node { nonsense");
    EXPECT_NE(trouble(scratch.path("in/bad.tsct"), {}, {scratch.path("in")}).find("bad.tsct:1"), std::string::npos);
    // A link leads out of the folder.
    scratch.write("out/b.tsct", kBox);
    std::filesystem::create_symlink(scratch.path("out/b.tsct"), scratch.path("in/link.tsct"));
    EXPECT_WORDS(trouble(scratch.path("in/link.tsct"), {}, {scratch.path("in")}));
}

TEST_F(InlineFiles, ThatAScenesFilesNameAreReadAndNoneBesideThem) {
    const std::string scene = scratch.write("in/scene.tsct", std::string(kBox) + R"(
        node { name: "a" inline { file: "sub/a.tsct" load: BY_HAND } }
        image { name: "i" } node { name: "film" movie { file: "film.mkv" image: "i" } })");
    const std::string a = scratch.write(
        "in/sub/a.tsct", std::string(kBox) + R"(node { name: "b" inline { file: "b.tsct" load: BY_HAND } })");
    const std::string b = scratch.write("in/sub/b.tsct", kBox), other = scratch.write("in/sub/other.tsct", kBox),
                      film = scratch.write("in/film.mkv", "no film");
    scratch.write("secret.tsct", kBox);
    const auto may = [](SceneFiles& files, const std::string& name) { return files.ofScene(name).has_value(); };
    const auto files = std::make_shared<SceneFiles>(importOptions(), std::vector<std::string>(), std::vector{scene});
    EXPECT_FALSE(may(*files, a)) << "nobody has named it yet";
    ASSERT_TRUE(start({scene}, files));
    EXPECT_TRUE(may(*files, a) && may(*files, film));
    for (const std::string& name :
         {b, other, scene, scratch.path("in/./sub/a.tsct"), std::string("/etc/passwd"), scratch.path("secret.tsct")})
        EXPECT_FALSE(may(*files, name)) << name;
    EXPECT_FALSE(files->ofApplication(a)) << "what an application loads itself is another matter";
    // What it names in its turn, once it is read.
    ASSERT_FALSE(read(files, a).refused);
    EXPECT_TRUE(may(*files, b) && !may(*files, other));
    // A wall that goes on from its journal imports no scene.
    SceneFiles again(importOptions(), {}, {scene}, true);
    EXPECT_TRUE(may(again, b) && may(again, film) && !may(again, other));
    // It has become a link that leads out of the folder.
    std::filesystem::remove(b);
    std::filesystem::create_symlink(scratch.path("secret.tsct"), b);
    EXPECT_FALSE(may(*files, b));
}

TEST_F(InlineFiles, BringWhatTheyHoldAndSayThatItIsThere) {
    const Preparation made = read(scratch.write("a.tsct", kBox), {}, {scratch.path("")});
    ASSERT_FALSE(made.refused) << made.refused->message;
    const ChangeList& list = made.lists.front();
    std::size_t said = 0;
    for (const FieldColumn& column : list.columns)
        if (column.type == typeOf<Inline>() && column.field == fieldId<&Inline::state>)
            said += column.ids == std::vector{ObjectId(40)};
    EXPECT_EQ(said, 1u);
    EXPECT_EQ(list.placements.front().parent, kRootNode);
}

TEST_F(InlineFiles, ThatInlineThemselvesAreRefusedWhateverTheyAreCalled) {
    const std::string a = scratch.write("a.tsct", R"(node { name: "x" inline { file: "b.tsct" } })"),
                      b = scratch.write("b.tsct", kBox);
    std::filesystem::create_symlink(a, scratch.path("other.tsct"));
    std::filesystem::create_directory(scratch.path("sub"));
    const std::vector<std::string> allowed{scratch.path("")};
    for (const std::string& name :
         {a, scratch.path("./a.tsct"), scratch.path("sub/../a.tsct"), scratch.path("other.tsct")}) {
        EXPECT_WORDS(trouble(name, {a, b}, allowed));
        EXPECT_WORDS(trouble(a, {name}, allowed));
    }
    EXPECT_EQ(trouble(b, {a}, allowed), "");
    // In one file, and through others: the rest of the scene is there.
    scratch.write("self.tsct", std::string(kBox) + R"(node { name: "me" inline { file: "./self.tsct" } })");
    Expected<Aspect> self = start({scratch.path("self.tsct")});
    ASSERT_TRUE(self) << self.error().message;
    EXPECT_TRUE(findNode(*self, "/box"));
    EXPECT_EQ(wishesOf(*self).at("/me").state, LoadWords::kFailed);
    scratch.write("one.tsct", R"(node { name: "one" inline { file: "two.tsct" } })");
    scratch.write("two.tsct", std::string(kBox) + R"(node { name: "two" inline { file: "one.tsct" } })");
    const Expected<Aspect> ring = start({scratch.path("one.tsct")});
    ASSERT_TRUE(ring) << ring.error().message;
    std::size_t failed = 0;
    for (const auto& [path, wish] : wishesOf(*ring)) failed += wish.state == LoadWords::kFailed;
    EXPECT_EQ(failed, 1u);
    EXPECT_LE(wishesOf(*ring).size(), 3u);
    EXPECT_TRUE(findNode(*ring, "/one/box"));
}

TEST_F(InlineFiles, OfASceneAreThereWithTheFirstFrameAndItsIdsAreThoseOfEveryStart) {
    scratch.write("house.tsct", std::string(kBox) + R"(node { name: "door" inline { file: "door.tsct" } })");
    scratch.write("door.tsct", kBox);
    const std::string scene = scratch.write("scene.tsct", std::string(kBox) + R"(
        node { name: "house" inline { file: "house.tsct" } }
        node { name: "missing" inline { file: "none.tsct" } }
        node { name: "mill" proxy_group { file: "door.tsct" distance: 1e9 upper { x: 1 y: 1 z: 1 } } }
        node { name: "hand" transform {} inline { file: "door.tsct" load: BY_HAND } })");
    const Expected<Aspect> first = start({scene}), second = start({scene});
    ASSERT_TRUE(first && second) << first.error().message;
    EXPECT_EQ(first->stateHash(), second->stateHash());
    EXPECT_TRUE(findNode(*first, "/house/door/box"));
    std::map<std::string, LoadWish> wishes = wishesOf(*first);
    EXPECT_EQ(wishes.at("/house").state, LoadWords::kThere);
    EXPECT_EQ(wishes.at("/house/door").state, LoadWords::kThere);
    EXPECT_EQ(wishes.at("/missing").state, LoadWords::kFailed);
    EXPECT_EQ(wishes.at("/mill").state, LoadWords::kWaiting) << "nobody stands anywhere yet";
    EXPECT_EQ(wishes.at("/hand/inline").state, LoadWords::kWaiting);
    EXPECT_EQ(wishes.at("/hand/inline").file, scratch.path("door.tsct"));
}

TEST_F(InlineFiles, SceneTextIsRefusedWhereItMakesNoSense) {
    const auto refusal = [&](const std::string& text) {
        const Expected<ImportedScene> scene = importScene(scratch.write("bad.tsct", text), kRootNode, importOptions());
        return scene ? "" : scene.error().message;
    };
    for (const char* text : {"inline { }", R"(inline { file: "/etc/passwd" })", R"(inline { file: "../a.tsct" })",
                             R"(inline { file: "a.tsct" } node {})", R"(proxy_group { file: "a.tsct" lower { y: 1 } })",
                             R"(inline { file: "a.tsct" distance: -1 })", R"(inline { file: "a.tsct" distance: nan })"})
        EXPECT_WORDS(refusal(std::string("node { ") + text + " }"));
    EXPECT_EQ(refusal(R"(node { inline { file: "a.tsct" load: NEAR distance: 3 wanted: true } })"), "");
}

}  // namespace
}  // namespace tessera
