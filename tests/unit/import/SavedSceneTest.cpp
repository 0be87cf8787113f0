/// Scenes saved to files and read back.
#include <fmt/format.h>
#include <sys/stat.h>

#include <random>

#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Transform.h"
#include "common/scenefile/SceneFile.h"
#include "tests/support/SceneStructure.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

const std::vector<std::string> kExtensions = {".tsc", ".tsct"};

/// Saves the scene both ways, reads it back, and compares.
void expectRoundTrip(const Aspect& scene) {
    const Scratch scratch;
    for (const std::string& extension : kExtensions) {
        const std::string path = scratch.path("saved" + extension);
        const Expected<void> saved = saveScene(path, scene);
        ASSERT_TRUE(saved) << saved.error().message;
        Expected<ImportedScene> back = importScene(path, kRootNode, importOptions());
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_TRUE(back->notes.empty()) << back->notes.front();
        const ImportedAspect again(std::move(*back));
        EXPECT_EQ(structureDifference(scene, *again), "") << extension;
        // What is saved again is the same file: numbers follow the tree, names of arrays what is in them.
        const std::string before = contentOf(path);
        ASSERT_TRUE(saveScene(path, *again));
        EXPECT_TRUE(contentOf(path) == before) << extension;
        const Expected<std::string> binary = writeScene(*again, SceneEncoding::kBinary);
        ASSERT_TRUE(binary) << binary.error().message;
        EXPECT_TRUE(*binary == *writeScene(scene, SceneEncoding::kBinary)) << extension;
    }
}

/// Imports the file, and expects that saving changes nothing, counts included.
void expectRoundTripOfFile(const std::string& path) {
    SCOPED_TRACE(path);
    Expected<ImportedScene> first = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(first) << first.error().message;
    const ImportedScene counts = *first;
    const ImportedAspect scene(std::move(*first));
    expectRoundTrip(*scene);
    const Scratch scratch;
    const std::string saved = scratch.path("counted.tsc");
    ASSERT_TRUE(saveScene(saved, *scene));
    const Expected<ImportedScene> back = importScene(saved, kRootNode, importOptions());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->nodes, counts.nodes);
    EXPECT_EQ(back->cores, counts.cores);
    EXPECT_EQ(back->geometries, counts.geometries);
    EXPECT_EQ(back->triangles, counts.triangles);
    EXPECT_EQ(back->trianglesStored, counts.trianglesStored);
    EXPECT_EQ(back->hasCamera, counts.hasCamera);
    EXPECT_EQ(back->tops.size(), counts.tops.size());
}

std::string smallScene() {
    return R"(material { name: "red" base_color { r: 1 } }
node { name: "crane" transform { translation { x: 0.1 y: -2 z: 1e-300 } } material: "red"
  node { name: "box" box { size { x: 1 y: 2 z: 3 } } }
  node { name: "same" box { size { x: 1 y: 2 z: 3 } } }
  node { motion { key { time: 0 transform {} } key { time: 1 transform { translation { x: 1 } } } mode: PING_PONG } } }
node { name: "rules" interest { object: "/crane" response: BOUNCE show_points: true } }
node { spot_light { outer_angle_deg: 30 } })";
}

/// A scene made of edits.
Aspect sceneOf(const std::function<void(ChangeListBuilder&)>& edit) {
    ChangeListBuilder list;
    edit(list);
    Aspect aspect;
    const Expected<void> applied = aspect.apply(list.take());
    EXPECT_TRUE(applied) << (applied ? "" : applied.error().message);
    return aspect;
}

TEST(SavedScene, OfEveryShippedFileIsTheSameWhenReadBack) {
    const std::string folder = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes";
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() != ".tsct") continue;
        const Expected<ImportedScene> readable = importScene(entry.path(), kRootNode, importOptions());
        if (!readable && readable.error().message.find("assimp-testmodels") != std::string::npos) continue;
        expectRoundTripOfFile(entry.path());
    }
}

TEST(SavedScene, OfRealModelsIsTheSameWhenReadBack) {
    std::vector<std::string> found;
    for (const std::string& folder :
         {std::string(TESSERA_SOURCE_DIR "/tests/data/models"), testData(), std::string(kDebianModels)}) {
        if (folder.empty() || !std::filesystem::exists(folder)) continue;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
            if ((entry.path().extension() == ".glb" || entry.path().extension() == ".gltf") &&
                entry.path().string().find("malformed") == std::string::npos)
                found.push_back(entry.path());
    }
    std::sort(found.begin(), found.end());
    const std::size_t wanted = kSanitized ? 4 : 12;
    std::size_t done = 0;
    // Spread over all of them; where one cannot be read (under a sanitizer memory is short), those that follow.
    const std::size_t stride = std::max<std::size_t>(1, found.size() / wanted);
    for (std::size_t first = 0; first < stride && done < wanted; ++first)
        for (std::size_t i = first; i < found.size() && done < wanted; i += stride) {
            const Expected<ImportedScene> readable = importScene(found[i], kRootNode, importOptions());
            if (!readable) continue;
            expectRoundTripOfFile(found[i]);
            ++done;
        }
    EXPECT_GE(done, 2u);
}

TEST(SavedScene, KeepsSharingTheRootsCoreAndWhatIsReferredTo) {
    const ObjectId transform{10}, first{11}, second{12}, outside{13}, below{14}, interest{15}, holder{16}, lost{17};
    const Aspect scene = sceneOf([&](ChangeListBuilder& list) {
        list.create(transform, typeOf<Transform>());
        setField<&Transform::translation>(list, transform, Vec3d(1, 2, 3));
        for (const ObjectId node : {first, second, outside, below, holder, lost}) list.create(node, typeOf<Node>());
        for (const ObjectId node : {first, second, kRootNode}) setField<&Node::core>(list, node, transform);
        setField<&Node::name>(list, first, "back\\slash and \"quotes\"");
        setField<&Node::name>(list, kRootNode, "world");
        for (const ObjectId node : {first, second, holder}) list.place(node, kRootNode);
        list.place(below, outside);
        list.create(interest, typeOf<Interest>());
        setField<&Node::core>(list, holder, interest);
        setField<&Interest::object>(list, interest, outside);
        setField<&Interest::against>(list, interest, kRootNode);
    });
    const Scratch scratch;
    for (const std::string& extension : kExtensions) {
        const std::string path = scratch.path("shared" + extension);
        ASSERT_TRUE(saveScene(path, scene));
        Expected<ImportedScene> back = importScene(path, kRootNode, importOptions());
        ASSERT_TRUE(back) << back.error().message;
        // The root has a core, so it comes back as a node of its own; nobody asked for the node that was lost.
        ASSERT_EQ(back->tops.size(), 1u);
        EXPECT_EQ(back->nodes, 6u);
        EXPECT_WORDS(notesIn(*back));
        const ImportedAspect again(std::move(*back));
        ASSERT_EQ(again->root().children.size(), 1u);
        EXPECT_EQ(structureDifference(scene, *again, kRootNode, again->root().children.front()), "");
    }
}

TEST(SavedScene, StandsBesideWhatAuthorsWrite) {
    const Scratch scratch;
    const Aspect scene = sceneOf([](ChangeListBuilder& list) {
        list.create(ObjectId{5}, typeOf<Node>());
        list.place(ObjectId{5}, kRootNode);
        setField<&Node::name>(list, ObjectId{5}, "saved");
    });
    const Expected<std::string> text = writeScene(scene, SceneEncoding::kText);
    ASSERT_TRUE(text);
    const Expected<ImportedScene> both =
        importScene(scratch.write("both.tsct", *text + "node { name: \"written\" box { size { x: 1 y: 1 z: 1 } } }"),
                    kRootNode, importOptions());
    ASSERT_TRUE(both) << both.error().message;
    EXPECT_EQ(both->tops.size(), 2u);
    const ImportedAspect aspect(*both);
    EXPECT_TRUE(findNode(*aspect, "/written"));
    EXPECT_TRUE(findNode(*aspect, "/saved"));
}

TEST(SavedScene, SaysWhereInATextItIsWrong) {
    const Scratch scratch;
    const auto says = [&](std::string_view body, std::string_view wanted) {
        const std::string path = scratch.write("wrong.tsct", body);
        const Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
        ASSERT_FALSE(scene) << body;
        EXPECT_EQ(scene.error().message, path + std::string(wanted));
        EXPECT_EQ(scene.error().code, ErrorCode::kBadInput);
    };
    const std::string root = "saved { root: 1\n  object { number: 1 child: 2 node {} }\n  ";
    says(root + "object { number: 2 node { nam: \"x\" } } }", ":3:32: Node has no 'nam'; did you mean 'name'?");
    says(root + "object { number: 2 node { core: 9 } } }",
         ":3:3: object 2 (Node): core names object 9, which does not exist");
    says(root + "object { number: 2 node { core: 1 } } }",
         ":3:3: object 2 (Node): core names object 1, which is of type Node");
    says(root + "object { number: 2 transform {} } }", ":2:3: object 1 (Node): its child 2 is no Node of this file");
    says(root + "object { number: 2 child: 2 node {} } }",
         ":3:3: object 2 (Node): it has two parents, or is a child twice");
    says(root + "object { number: 1 node {} } }", ":3:3: object 1 (Node): its number is there twice");
    says(root + "object { number: 2 node {} } object { number: 3 transform { scale: [1, 2] } } }",
         ":3:32: object 3 (Transform): scale has 2 numbers, not 3");
    says(root + "object { number: 2 node {} } object { number: 3 transform { rotation: [0, 0, 0, 0] } } }",
         ":3:32: object 3 (Transform): rotation is zero, which has no direction");
    says(root + "object { number: 2 node {} } object { number: 3 motion { keys: 1 } } }",
         ":3:32: object 3 (Motion): keys names array 1, which does not exist");
    says("saved { object { number: 1 node {} } }", ": what it saved has no root: 'root' must be the number of a Node");
    says(
        "saved { root: 1 object { number: 1 node {} } object { number: 2 child: 3 node {} } object { number: 3 child: "
        "2 node {} } }",
        ": some of its nodes are below themselves");
}

TEST(SavedScene, OfAnArrayThatIsNotHereIsRefused) {
    const Aspect scene = sceneOf([](ChangeListBuilder& list) {
        list.create(ObjectId{5}, typeOf<Node>());
        list.create(ObjectId{6}, typeOf<Geometry>());
        list.place(ObjectId{5}, kRootNode);
        setField<&Node::core>(list, ObjectId{5}, ObjectId{6});
        setField<&Geometry::positions>(list, ObjectId{6}, Blob::absent({1, 2}, 36));
    });
    const Expected<std::string> saved = writeScene(scene, SceneEncoding::kBinary);
    ASSERT_FALSE(saved);
    EXPECT_EQ(saved.error().message, "the positions of Geometry #6 (36 bytes) are not here");
}

TEST(SavedScene, TakesThePlaceOfTheFileAndNothingElse) {
    const Scratch scratch;
    const std::string file = scratch.write("there.tsc", "before"), link = scratch.path("link.tsc");
    std::filesystem::permissions(file, std::filesystem::perms(0600));
    std::filesystem::create_symlink("there.tsc", link);
    ASSERT_TRUE(saveScene(link, Aspect()));
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_NE(contentOf(file), "before");
    EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms(0600));
    const mode_t mask = ::umask(027);
    ASSERT_TRUE(saveScene(scratch.path("new.tsc"), Aspect()));
    ::umask(mask);
    EXPECT_EQ(std::filesystem::status(scratch.path("new.tsc")).permissions(), std::filesystem::perms(0640));
    std::filesystem::create_symlink("/dev/full", scratch.path("full.tsc"));
    const Expected<void> refused = saveScene(scratch.path("full.tsc"), Aspect());
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message,
              scratch.path("full.tsc") + ": cannot write there: this is a folder, device, pipe or socket");
    EXPECT_TRUE(std::filesystem::is_symlink(scratch.path("full.tsc")));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path("")), {}), 4);
}

/// A node with this many children, the child's number in each name.
Aspect wideScene(std::uint64_t children) {
    return sceneOf([&](ChangeListBuilder& list) {
        list.create(ObjectId{5}, typeOf<Node>());
        list.place(ObjectId{5}, kRootNode);
        for (std::uint64_t id = 6; id < 6 + children; ++id) {
            list.create(ObjectId{id}, typeOf<Node>());
            list.place(ObjectId{id}, ObjectId{5});
        }
    });
}

TEST(SavedScene, CostsAsMuchToWriteAsItHasObjects) {
    // Were it quadratic, these would be 10^11 steps, which no time-out of a test allows.
    const Aspect wide = wideScene(kSanitized ? 64'000 : 320'000);
    for (const SceneEncoding encoding : {SceneEncoding::kBinary, SceneEncoding::kText}) {
        EXPECT_TRUE(writeScene(wide, encoding));
    }
}

TEST(SavedScene, IsAsDeepAsALiveSceneCanBe) {
    // The root, and all that fits below it; and as many out of the tree.
    const std::uint64_t depth = SceneLimits().maxDepth;
    expectRoundTrip(sceneOf([&](ChangeListBuilder& list) {
        ObjectId above = kRootNode;
        for (std::uint64_t id = 5; id < 5 + depth - 1; ++id) {
            list.create(ObjectId{id}, typeOf<Node>());
            list.place(ObjectId{id}, above);
            above = ObjectId{id};
        }
        list.create(ObjectId{1000}, typeOf<Interest>());
        setField<&Node::core>(list, above, ObjectId{1000});
        setField<&Interest::object>(list, ObjectId{1000}, ObjectId{2000});
        for (std::uint64_t id = 2000; id < 2000 + depth; ++id) {
            list.create(ObjectId{id}, typeOf<Node>());
            if (id > 2000) list.place(ObjectId{id}, ObjectId{id - 1});
        }
    }));
    // What authors write, too.
    const Scratch scratch;
    std::string text;
    for (std::uint64_t i = 1; i < depth; ++i) text += "node { ";
    text += "transform { rotation { axis { x: 1 } } }";
    for (std::uint64_t i = 1; i < depth; ++i) text += " }";
    Expected<ImportedScene> scene = importScene(scratch.write("deep.tsct", text), kRootNode, importOptions());
    ASSERT_TRUE(scene) << scene.error().message;
    expectRoundTrip(*ImportedAspect(std::move(*scene)));
    EXPECT_FALSE(importScene(scratch.write("deeper.tsct", "node { " + text + " }"), kRootNode, importOptions()));
}

TEST(SavedScene, MayHaveMoreNodesThanAuthorsMayWrite) {
    if (kSanitized) GTEST_SKIP() << "the sanitizers' own memory is beyond any limit";
    constexpr std::uint64_t kEach = 600'000;
    std::string text = "saved { root: 1 object { number: 1 child: [2, 3] node {} }\n";
    for (std::uint64_t parent : {2, 3}) {
        text += fmt::format("object {{ number: {} node {{}} child: [", parent);
        for (std::uint64_t i = 0; i < kEach; ++i)
            text += fmt::format("{}{}", i ? "," : "", 4 + (parent - 2) * kEach + i);
        text += "] }\n";
    }
    for (std::uint64_t i = 0; i < 2 * kEach; ++i) text += fmt::format("object {{ number: {} node {{}} }}\n", 4 + i);
    const Scratch scratch;
    // The bounds of a file follow its bytes.
    ImportOptions options = importOptions();
    options.maxMemoryBytes = std::size_t{400} << 20;
    const Expected<ImportedScene> scene = importScene(scratch.write("wide.tsct", text + "}"), kRootNode, options);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->nodes, 2 * kEach + 2);
}

// ---- newer versions

std::string field(int number, std::string_view bytes) {
    std::string out;
    for (std::uint32_t tag = static_cast<std::uint32_t>(number) << 3 | 2;; tag >>= 7) {
        out += static_cast<char>(tag > 127 ? tag | 128 : tag);
        if (tag < 128) break;
    }
    out += static_cast<char>(bytes.size());
    return out + std::string(bytes);
}
std::string number(int field, char value) {
    return std::string{static_cast<char>(field << 3), value};
}

ObjectId realId(ObjectId id) {
    return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + kRootNode.value + 1} : id;
}

/// What tessera-convert does; returns the notes.
std::vector<std::string> convert(const std::string& from, const std::string& to) {
    Expected<ImportedScene> scene = importScene(from, kRootNode, importOptions());
    EXPECT_TRUE(scene) << scene.error().message;
    if (!scene) return {};
    LaterParts kept = scene->later;
    kept.replaceIds(realId);
    const std::vector<std::string> notes = scene->notes;
    const ImportedAspect aspect(std::move(*scene));
    const Expected<void> written = saveScene(to, *aspect, kept);
    EXPECT_TRUE(written) << written.error().message;
    return notes;
}

TEST(SavedScene, OfANewerVersionKeepsWhatIsNotUnderstood) {
    // A root with a child whose core is of type 777, and a transform with a field 50; arrays that only these name.
    const std::string later = field(877, "anything" + number(1, 2));
    const std::string saved = field(1, number(1, 7) + number(2, 3) + field(101, "")) +
                              field(1, number(1, 3) + number(2, 9) + field(101, field(1, "new") + number(2, 4))) +
                              field(1, number(1, 4) + later) + field(1, number(1, 9) + field(101, number(2, 5))) +
                              field(1, number(1, 5) + field(103, field(50, "more"))) + number(2, 7) + field(60, "also");
    const std::string file = field(16, saved) + field(15, "first array") + field(15, "second array") + field(99, "top");
    const Scratch scratch;
    const auto convertAndName = [&](const std::string& from, const std::string& to) {
        const std::vector<std::string> notes = convert(from, to);
        EXPECT_EQ(notes.size(), 4u);
        for (const std::string& note : notes) EXPECT_WORDS(note);
    };
    const std::string first = scratch.write("newer.tsc", file);
    convertAndName(first, scratch.path("kept.tsc"));
    convertAndName(scratch.path("kept.tsc"), scratch.path("kept.tsct"));
    convertAndName(scratch.path("kept.tsct"), scratch.path("again.tsc"));
    const std::string kept = contentOf(scratch.path("kept.tsc"));
    EXPECT_EQ(kept, contentOf(scratch.path("again.tsc")));
    // Numbers are those of the file, and everything that is not understood is there, as are the refs to it.
    for (const std::string& part :
         {later, number(1, 4), field(50, "more"), field(60, "also"), field(99, "top"),
          field(15, "first array") + field(15, "second array"), field(1, "new") + number(2, 4)})
        EXPECT_NE(kept.find(part), std::string::npos) << testing::PrintToString(part);
}

/// A root with a node, which has this core.
std::string savedWithCore(std::string_view core) {
    return field(1, number(1, 1) + number(2, 2) + field(101, "")) + field(1, number(1, 2) + field(101, number(2, 3))) +
           field(1, number(1, 3) + std::string(core)) + number(2, 1);
}

TEST(SavedScene, OfANewerVersionKeepsEqualArraysApart) {
    const Scratch scratch;
    const std::string arrays = field(15, "equal") + field(15, "equal") + field(15, "") + field(15, "third");
    const std::string first = scratch.write("newer.tsc", field(16, savedWithCore(field(877, number(1, 4)))) + arrays);
    (void)convert(first, scratch.path("kept.tsct"));
    (void)convert(scratch.path("kept.tsct"), scratch.path("kept.tsc"));
    EXPECT_NE(contentOf(scratch.path("kept.tsc")).find(arrays), std::string::npos);
}

TEST(SavedScene, KeepsWordsOfANewerVersion) {
    // An Interest whose response and mode are words of later, and one more bit of what it shows.
    const std::string later = number(3, 9) + number(5, 77) + number(10, 9);
    const TypeInfo& type = Object::of(Interest()).info();
    ASSERT_EQ(type.type.value, 13);
    ASSERT_EQ(findField(type, "response")->id.value, 3);
    ASSERT_EQ(findField(type, "mode")->id.value, 5);
    ASSERT_EQ(findField(type, "show")->id.value, 10);
    const Scratch scratch;
    const std::string first = scratch.write("newer.tsc", field(16, savedWithCore(field(113, later))));
    const Expected<ImportedScene> scene = importScene(first, kRootNode, importOptions());
    ASSERT_TRUE(scene) << scene.error().message;
    const ImportedAspect aspect(*scene);
    const Interest* interest = aspect->coreOf<Interest>(*aspect->get<Node>(aspect->root().children.front()));
    ASSERT_NE(interest, nullptr);
    EXPECT_EQ(interest->response, Interest().response);
    EXPECT_EQ(interest->mode, Interest().mode);
    EXPECT_EQ(interest->show, Interest::kShowPoints);
    const std::vector<std::string> notes = convert(first, scratch.path("kept.tsct"));
    EXPECT_EQ(convert(scratch.path("kept.tsct"), scratch.path("kept.tsc")).size(), 3u);
    EXPECT_EQ(convert(first, scratch.path("other.tsc")).size(), 3u);
    EXPECT_EQ(contentOf(scratch.path("kept.tsc")), contentOf(scratch.path("other.tsc")));
    EXPECT_NE(contentOf(scratch.path("kept.tsc")).find(later), std::string::npos);
    ASSERT_EQ(notes.size(), 3u);
    for (const std::string& note : notes) EXPECT_WORDS(note);
    // Who has given the field another value since is right.
    Expected<ImportedScene> edited = importScene(first, kRootNode, importOptions());
    ASSERT_TRUE(edited);
    edited->later.replaceIds(realId);
    replaceIds(edited->list, realId);
    ChangeListBuilder edit;
    setField<&Interest::response>(edit, edited->later.words.begin()->first.first, Interest::kBounce);
    Aspect changed;
    ASSERT_TRUE(changed.apply(edited->list));
    ASSERT_TRUE(changed.apply(edit.take()));
    const Expected<std::string> text = writeScene(changed, SceneEncoding::kText, edited->later);
    ASSERT_TRUE(text);
    EXPECT_NE(text->find("response: RESPONSE_BOUNCE"), std::string::npos) << *text;
    EXPECT_NE(text->find("mode: 77"), std::string::npos) << *text;
}

TEST(SavedScene, NamesWhatANewerVersionWroteBesideIt) {
    const Scratch scratch;
    const std::string beside = number(9, 1) + field(34, "beside");
    const std::string saved =
        field(1, number(1, 1) + number(2, 2) + field(101, "")) + field(1, number(1, 2) + field(101, "")) + number(2, 1);
    const std::string authored = field(6, field(1, "written"));
    for (const std::string& what : {field(16, saved), authored}) {
        const std::string first = scratch.write("newer.tsc", what + beside + field(15, "array"));
        for (const auto& [from, to] :
             {std::pair(first, "kept.tsct"), std::pair(scratch.path("kept.tsct"), "kept.tsc")}) {
            const std::vector<std::string> notes = convert(from, scratch.path(to));
            ASSERT_EQ(notes.size(), 1u);
            EXPECT_WORDS(notes[0]);
        }
        const std::string kept = contentOf(scratch.path("kept.tsc"));
        EXPECT_NE(kept.find(field(15, "array") + beside), std::string::npos);
    }
}

TEST(SavedScene, NamesWhatANewerVersionAddedToWhatAuthorsWrite) {
    const Scratch scratch;
    const std::string unit = std::string("\x09\0\0\0\0\0\0\xf0\x3f", 9);  // x: 1
    std::string size = unit + unit + unit;
    size[9] = 0x11, size[18] = 0x19;
    const std::string box = field(6, field(1, "box") + field(10, field(1, size) + number(9, 5)));
    const std::string unknown = field(6, field(1, "auth") + field(99, number(1, 2)));
    const std::string motion = field(6, field(2, "") + field(24, number(2, 9) + field(4, "")));
    const Expected<ImportedScene> scene =
        importScene(scratch.write("newer.tsc", box + unknown + motion), kRootNode, importOptions());
    ASSERT_TRUE(scene) << scene.error().message;
    ASSERT_EQ(scene->notes.size(), 3u);
    for (const std::string& note : scene->notes) EXPECT_WORDS(note);
    EXPECT_EQ(scene->triangles, 12u);
}

TEST(SavedScene, IsRefusedWhereItsQuotedPartsAreDamaged) {
    const Scratch scratch;
    const std::string saved = "saved { root: 1 object { number: 1 node {} }\n  ";
    const auto refused = [&](const std::string& body, const std::string& wanted) {
        const std::string path = scratch.write("quoted.tsct", body);
        const Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
        ASSERT_FALSE(scene) << body;
        EXPECT_EQ(scene.error().message, path + wanted);
        EXPECT_EQ(scene.error().code, ErrorCode::kBadInput);
    };
    refused(saved + "later_file: \"\\377\" }", ":2:3: what later_file quotes is damaged");
    refused(saved + "later_file: \"\\202\\001\\000\\202\\001\\002\\020\\001\" }",
            ":2:3: what later_file quotes is damaged");  // saved
    refused(saved + "later: \"\\377\" }", ":2:3: what later quotes is damaged");
    refused(saved + "later_file: \"\\063\\064\" }", ":2:3: what later_file quotes is damaged");  // groups
    // As if it stood there: a second object with the number.
    refused(saved + "later: \"\\n\\005\\010\\001\\252\\006\\000\" }", ": object 1 (Node): its number is there twice");
    // In a binary file nothing needs quoting, but somebody may.
    const std::string binary = scratch.write(
        "quoted.tsc", field(16, field(1, number(1, 1) + field(101, "")) + number(2, 1) + field(4, "\xff")));
    EXPECT_EQ(messageOf(importScene(binary, kRootNode, importOptions())), binary + ": what it saved is damaged");
    const std::string known = scratch.write(
        "known.tsc", field(16, field(1, number(1, 1) + field(101, "")) + number(2, 1) + field(4, field(6, "\xff"))));
    EXPECT_EQ(messageOf(importScene(known, kRootNode, importOptions())), known + ": what it saved is damaged");
}

TEST(SavedScene, KeepsArraysOfNoBytes) {
    expectRoundTrip(sceneOf([](ChangeListBuilder& list) {
        list.create(ObjectId{5}, typeOf<Node>());
        list.create(ObjectId{6}, typeOf<Geometry>());
        list.place(ObjectId{5}, kRootNode);
        setField<&Node::core>(list, ObjectId{5}, ObjectId{6});
        setField<&Geometry::positions>(list, ObjectId{6}, Blob::of(std::span<const float>()));
        setField<&Geometry::indices>(list, ObjectId{6}, Blob::of(std::span<const float>()));
    }));
}

// ---- hostile files

TEST(SavedScene, CutOrDamagedIsRefusedOrSomethingValid) {
    const Scratch scratch;
    Expected<ImportedScene> first = importScene(scratch.write("small.tsct", smallScene()), kRootNode, importOptions());
    ASSERT_TRUE(first) << first.error().message;
    const ImportedAspect scene(std::move(*first));
    std::mt19937 random(11);
    std::size_t refused = 0, valid = 0;
    const auto feed = [&](const std::string& path) {
        Expected<ImportedScene> read = importScene(path, kRootNode, importOptions());
        if (!read) {
            ++refused;
            EXPECT_EQ(read.error().message.compare(0, path.size(), path), 0) << read.error().message;
            EXPECT_EQ(read.error().message.find("crash"), std::string::npos) << read.error().message;
            EXPECT_EQ(read.error().message.find("aborted"), std::string::npos) << read.error().message;
            return;
        }
        ++valid;
        const ImportedAspect applied(std::move(*read));  // expects that the scene takes it
    };
    for (const std::string& extension : kExtensions) {
        const Expected<std::string> whole = writeScene(*scene, *sceneEncodingOf(extension));
        ASSERT_TRUE(whole);
        const int rounds = kSanitized ? 25 : 150;
        for (int i = 0; i < rounds; ++i) {
            std::string bad = *whole;
            if (i % 3 == 0) {
                bad.resize(std::uniform_int_distribution<std::size_t>(0, bad.size() - 1)(random));
            } else {
                // Where the objects are, mostly: arrays of numbers have nothing to refuse.
                const std::size_t end = i % 3 == 1 ? bad.size() : std::min<std::size_t>(bad.size(), 400);
                for (int flips = 0; flips < 1 + i % 4; ++flips)
                    bad[std::uniform_int_distribution<std::size_t>(0, end - 1)(random)] ^=
                        static_cast<char>(1 << std::uniform_int_distribution<int>(0, 7)(random));
            }
            feed(scratch.write("bad" + extension, bad));
        }
    }
    EXPECT_GT(refused, 20u);
    RecordProperty("valid", static_cast<int>(valid));
}

}  // namespace
}  // namespace tessera
