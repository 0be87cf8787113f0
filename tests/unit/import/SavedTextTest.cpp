/// Saved texts as people read, write and break them.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <limits>
#include <thread>

#include "common/base/FileHandle.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Material.h"
#include "common/cores/Motion.h"
#include "common/cores/Transform.h"
#include "common/scenefile/ArraysFile.h"
#include "common/scenefile/SavedText.h"
#include "common/scenefile/SceneFile.h"
#include "tests/support/SceneStructure.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

/// What authors write, saved: a red box that drives, two lamps of one kind, rules.
std::string savedYard(const Scratch& scratch, const std::string& name = "yard.tsct") {
    const std::string authored = scratch.write("authored.tsct", R"(material { name: "red" base_color { r: 1 } }
node { name: "crate" transform { translation { x: 1 } } material: "red"
  node { name: "box" box { size { x: 1 y: 2 z: 3 } } } node { name: "lid" box { size { x: 1 y: 1 z: 3 } } } }
node { name: "post" transform { translation { x: 5 } } material: "red" box { size { x: 1 y: 2 z: 3 } } }
node { name: "drive" motion { target: "crate" key { time: 0 transform {} }
  key { time: 1 transform { translation { x: 1 } } } mode: PING_PONG } }
node { name: "grüße" interest { object: "/crate" against: "/post" response: BOUNCE } })");
    Expected<ImportedScene> scene = importScene(authored, kRootNode, importOptions());
    EXPECT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(saveScene(scratch.path(name), *ImportedAspect(std::move(*scene))));
    return scratch.path(name);
}

void replaceOnce(std::string& text, std::string_view what, std::string_view with) {
    const std::size_t at = text.find(what);
    ASSERT_NE(at, std::string::npos) << what << " in\n" << text;
    text.replace(at, what.size(), with);
}

std::size_t timesIn(const std::string& text, std::string_view what) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += what.size()) ++count;
    return count;
}

std::vector<std::string> arraysIn(const Scratch& scratch) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path("")))
        if (entry.path().extension() == ".arrays") names.push_back(entry.path().filename());
    return names;
}

/// A scene whose arrays are others than the yard's, and of each radius others.
ImportedAspect sphereOf(double radius) {
    const Scratch scratch;
    Expected<ImportedScene> scene =
        importScene(scratch.write("o.tsct", fmt::format("node {{ sphere {{ radius: {} segments: 12 }} }}", radius)),
                    kRootNode, importOptions());
    if (!scene) std::abort();
    return ImportedAspect(std::move(*scene));
}

std::vector<std::string> sortedFilesIn(const Scratch& scratch) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path("")))
        names.push_back(entry.path().filename());
    std::ranges::sort(names);
    return names;
}

Expected<ImportedScene> editedText(const Scratch& scratch, const std::string& text) {
    return importScene(scratch.write("edited.tsct", text), kRootNode, importOptions());
}

TEST(SavedText, ReadsAsAPersonWouldWriteIt) {
    const Scratch scratch;
    const std::string text = contentOf(savedYard(scratch));
    for (const char* part :
         {"\n  material { id: \"material-1\" base_color: [1, 0, 0, 1] }\n",
          "\n  node { name: \"crate\"\n    transform { translation: [1, 0, 0] }\n    node { name: \"box\" core: \"box "
          "geometry\" }\n",
          "\n  geometry { id: \"box geometry\"\n    positions { array: 1 }\n", "        material: \"material-1\"\n",
          "\n  node { name: \"grüße\" interest { object: \"crate\" against: \"post\" response: RESPONSE_BOUNCE } }\n",
          "motion { target: \"crate\" keys { array: "})
        EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
    EXPECT_EQ(text.find("number"), std::string::npos);
    std::size_t from = 0;
    for (std::size_t end = 0; (end = text.find('\n', from)) != std::string::npos; from = end + 1)
        EXPECT_LE(end - from, 120u) << text.substr(from, end - from);
}

TEST(SavedText, TakesWhatAHandAddsCopiesDeletesAndRenames) {
    const Scratch scratch;
    const std::string whole = contentOf(savedYard(scratch));
    {
        std::string text = whole;
        replaceOnce(text, "\n  node { name: \"post\"",
                    "\n  # a lamp\n  node { name: \"lamp\" point_light { intensity: 8; color: [1, 1, 0] }, }"
                    "\n  node { name: \"post\"");
        Expected<ImportedScene> scene = editedText(scratch, text);
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
        EXPECT_TRUE(findNode(*ImportedAspect(std::move(*scene)), "/lamp"));
    }
    {  // A copy means its own parts, and others the first.
        std::string text = whole;
        const std::size_t from = text.find("  node { name: \"crate\""), to = text.find("  node { name: \"post\"");
        const std::string crate = text.substr(from, to - from);
        text.insert(to, crate);
        Expected<ImportedScene> scene = editedText(scratch, text);
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_EQ(scene->tops.size(), 5u);
        EXPECT_WORDS(notesIn(*scene));
        const ImportedAspect aspect(std::move(*scene));
        const auto* motion = allOf<Motion>(aspect).at(0);
        EXPECT_EQ(motion->target, aspect->get<Node>(aspect->root().children[0])->core);
        EXPECT_EQ(allOf<Interest>(aspect).at(0)->object, aspect->root().children[0]);
    }
    {  // Inside of its own copy a name means what is near.
        std::string text = whole;
        replaceOnce(text, "\n  node { name: \"post\"",
                    "\n  node { name: \"second\" node { name: \"crate\" transform {} }"
                    " node { motion { target: \"crate\" } } }\n  node { name: \"post\"");
        Expected<ImportedScene> scene = editedText(scratch, text);
        ASSERT_TRUE(scene) << messageOf(scene);
        const ImportedAspect aspect(std::move(*scene));
        const Node* second = aspect->get<Node>(*findNode(*aspect, "/second"));
        const Node* inner = aspect->get<Node>(second->children[1]);
        EXPECT_EQ(aspect->coreOf<Motion>(*inner)->target, aspect->get<Node>(second->children[0])->core);
    }
    {
        std::string text = whole;
        const std::size_t from = text.find("  node { name: \"drive\""), to = text.find('\n', from);
        text.erase(from, to - from);
        EXPECT_TRUE(editedText(scratch, text));
    }
    std::string text = whole;
    while (text.find("material-1") != std::string::npos) replaceOnce(text, "material-1", "rote Farbe");
    EXPECT_TRUE(editedText(scratch, text)) << messageOf(editedText(scratch, text));
}

TEST(SavedText, WhatIsWrongIsSaidWithItsPlaceAndTheNearestName) {
    const Scratch scratch;
    const auto says = [&](std::string_view inside, std::string_view wanted) {
        const std::string path = scratch.write("wrong.tsct", fmt::format("saved {{\n  {}\n}}", inside));
        const Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
        ASSERT_FALSE(scene) << inside;
        EXPECT_EQ(scene.error().message, fmt::format("{}:{}", path, wanted));
    };
    says("node { nam: \"x\" }", "2:10: Node has no 'nam'; did you mean 'name'?");
    says("nod { }", "2:3: saved has no 'nod'; did you mean 'node'?");
    says("material { id: \"steel\" } node { geometry { material: \"stell\" } }",
         "2:56: material: there is no Material 'stell'; did you mean 'steel'?");
    says("node { name: \"a\" geometry { material: \"a\" } }",
         "2:41: material leads to a Material, and 'a' is of type Node");
    says("node { name: \"a\" transform { scale: [1, 2] } }", "2:20: Transform: scale has 2 numbers, not 3");
    says("node { name: \"a\" transform { scale: [1, 2, x] } }", "2:46: scale cannot be 'x': expected a number");
    says("node { transform {} camera {} }", "2:23: this node has a core already");
    says("node { name: \"a\" name: \"b\" }", "2:20: name is there twice");
    says("node { motion { mode: PINGPONG } }",
         "2:25: mode cannot be PINGPONG (it can be MODE_ONCE, MODE_LOOP, MODE_PING_PONG)");
    says("node { name: \"a\" transform { translation: [0, 0, 0] node { } }",
         "2:55: Transform has no 'node'; is the '{' of transform in line 2 closed?");
    says("node { name: \"a\"", "3:2: the file ends here, and the '{' of saved in line 1 is not closed");
    says("node { geometry { positions { array: 3 } } }", "2:31: there is no array 3: the scene has 0");
    says("node { geometry { positions: [0, 1, 256] colors: [0, 1, 256, 1] } }",
         "2:59: colors cannot be '256': expected a whole number in its bounds");
    says("node { name: \"\\377\" }", "2:16: this name is no UTF-8");
    says("node { interest { object { name: \"x\" } } }", "2:28: object names a node that stands elsewhere: \"name\"");
    says("root {} root {}", "2:11: root is there twice");
    says("arrays { file: \"../a.arrays\" id: \"1\" }",
         "2:3: the arrays lie beside the text: `file` is a name that ends in .arrays, without a folder");
    says("arrays { file: \"a.arrays\" id: \"1\" file: \"b.arrays\" }", "2:37: file is there twice");
    says("arrays { id: \"1\" id: \"1\" }", "2:20: id is there twice");
    says("array: \"\" node { geometry { positions { array: 1 array: 1 } } }", "2:52: array is there twice");
    says("arrays { file: \"/etc/passwd\" id: \"1\" }",
         "2:3: the arrays lie beside the text: `file` is a name that ends in .arrays, without a folder");
    EXPECT_EQ(messageOf(editedText(scratch, "saved { node {} }\nsaved { node {} }")),
              scratch.path("edited.tsct") + ":2:1: saved is there twice");
    const std::string flat = "saved { root: 1 object { number: 1 node {} } }";
    EXPECT_EQ(messageOf(editedText(scratch, "saved { node {} }\n" + flat)),
              scratch.path("edited.tsct") + ": saved is there twice");
}

TEST(SavedText, TakesWordsAsAuthorsWriteThem) {
    const Scratch scratch;
    Expected<ImportedScene> scene = editedText(
        scratch, "saved: { node: { motion { mode: PING_PONG time: 0x10 playing: false keys: \"\" } } }\n# end");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_EQ(allOf<Motion>(aspect).at(0)->mode, Motion::kPingPong);
    EXPECT_EQ(allOf<Motion>(aspect).at(0)->time, 16);
}

TEST(SavedText, MayHaveNothingLeft) {
    const Scratch scratch;
    for (const char* text : {"saved { }", "saved: {}", "saved {\n  # all gone\n}\n"}) {
        Expected<ImportedScene> scene = editedText(scratch, text);
        ASSERT_TRUE(scene) << text << "\n" << messageOf(scene);
        EXPECT_TRUE(scene->tops.empty()) << text;
    }
}

TEST(SavedText, PlacesBehindItAreThoseOfTheFile) {
    const Scratch scratch;
    // Tabs inside of it lead as far as tabs before it. Protobuf says the place of the brace.
    EXPECT_EQ(messageOf(editedText(scratch, "saved {\n\tnode { } }\tnod { }")),
              scratch.path("edited.tsct") + ":2:29: SceneFile has no 'nod'; did you mean 'node'?");
    std::string far = "saved { node { } }";
    far.insert(0, std::size_t{1} << 28, '\t');  // 2^31 columns
    const Expected<std::optional<SavedPart>> part = findSavedPart(far);
    ASSERT_TRUE(part && *part);
    EXPECT_GT((*part)->column, 999'999'999);
}

TEST(SavedText, IsBoundedInDepth) {
    const Scratch scratch;
    const auto nested = [](std::size_t depth) {
        std::string text = "saved {";
        for (std::size_t i = 0; i < depth; ++i) text += " node {";
        for (std::size_t i = 0; i < depth; ++i) text += " }";
        return text + " }";
    };
    EXPECT_TRUE(editedText(scratch, nested(SceneLimits().maxDepth - 1)));
    EXPECT_FALSE(editedText(scratch, nested(SceneLimits().maxDepth)));
    const std::string deep = messageOf(editedText(scratch, nested(200'000)));
    EXPECT_WORDS(deep);
}

/// Materials that lead to each other in a ring, and one that leads to itself.
TEST(SavedText, CirclesOfNamesAreAsInAScene) {
    const Scratch scratch;
    Expected<ImportedScene> scene = editedText(scratch, R"(saved {
  material { id: "a" coarser: "b" coarser_below: 3 } material { id: "b" coarser: "a" coarser_below: 2 }
  node { geometry { material: "a" } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    ASSERT_TRUE(saveScene(scratch.path("ring.tsct"), *ImportedAspect(std::move(*scene))));
    EXPECT_TRUE(importScene(scratch.path("ring.tsct"), kRootNode, importOptions()));
}

TEST(SavedText, OfEarlierVersionsIsRead) {
    const std::string folder = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/";
    Expected<ImportedScene> flat = importScene(folder + "saved-flat.tsct", kRootNode, importOptions());
    ASSERT_TRUE(flat) << messageOf(flat);
    Expected<ImportedScene> authored = importScene(folder + "surface.tsct", kRootNode, importOptions());
    ASSERT_TRUE(authored) << messageOf(authored);
    EXPECT_EQ(structureDifference(*ImportedAspect(std::move(*authored)), *ImportedAspect(std::move(*flat))), "");
}

// ---- the arrays beside

TEST(SavedText, NamesTheArraysBesideIt) {
    const Scratch scratch;
    const std::string path = savedYard(scratch);
    const std::vector<std::string> arrays = arraysIn(scratch);
    ASSERT_EQ(arrays.size(), 1u);
    EXPECT_TRUE(arrays[0].starts_with("yard.")) << arrays[0];
    const Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    // So that whoever watches the scene's files watches this one.
    EXPECT_TRUE(std::ranges::find(scene->files, scratch.path(arrays[0])) != scene->files.end());

    const std::string whole = contentOf(scratch.path(arrays[0]));
    const auto refused = [&](const std::string& content, std::string_view why) {
        scratch.write(arrays[0], content);
        const std::string message = messageOf(importScene(path, kRootNode, importOptions()));
        EXPECT_EQ(message, fmt::format("{}:4:3: the file '{}' beside it {}", path, arrays[0], why));
    };
    refused("nothing", "is no file of arrays");
    refused(whole.substr(0, 20), "is damaged: it ends too early");
    refused(whole.substr(0, whole.size() - 1), "is damaged: it ends too early");
    refused(whole + "x", "is damaged: it has more bytes than arrays");
    std::string bad = whole;
    bad.back() ^= 1;
    refused(bad, fmt::format("is damaged: array {} is not what was written", static_cast<unsigned char>(whole[8])));
    bad = whole;
    bad[16] ^= 1;
    refused(bad, "is damaged: its head is not what was written");
    bad = whole;
    bad[15] = '\x7f';
    refused(bad, "is damaged: it ends too early");
    std::filesystem::remove(scratch.path(arrays[0]));
    EXPECT_EQ(messageOf(importScene(path, kRootNode, importOptions())),
              fmt::format("{}:4:3: its arrays lie in '{}' beside it, which cannot be read: '{}': No such file or "
                          "directory",
                          path, arrays[0], arrays[0]));
}

TEST(SavedText, RefusesTheArraysOfAnotherSaveAndWhatLiesElsewhere) {
    const Scratch scratch, outside;
    const std::string path = savedYard(scratch);
    const std::string name = arraysIn(scratch).at(0);
    Expected<ImportedScene> other =
        importScene(scratch.write("o.tsct", "node { sphere { radius: 2 segments: 12 } }"), kRootNode, importOptions());
    ASSERT_TRUE(other);
    std::string arrays;
    ASSERT_TRUE(saveScene(outside.path("other.tsct"), *ImportedAspect(std::move(*other)), {}, &arrays));
    ASSERT_FALSE(arrays.empty());
    std::filesystem::copy_file(arrays, scratch.path(name), std::filesystem::copy_options::overwrite_existing);
    const std::string torn = messageOf(importScene(path, kRootNode, importOptions()));
    EXPECT_NE(torn.find(fmt::format(":4:3: the file '{}' beside it holds the arrays of another save (", name)),
              std::string::npos)
        << torn;
    // A link out of the folder.
    const std::string good = savedYard(outside);
    std::filesystem::remove(scratch.path(name));
    std::filesystem::create_symlink(outside.path(name), scratch.path(name));
    ASSERT_TRUE(std::filesystem::exists(scratch.path(name)));
    EXPECT_WORDS(messageOf(importScene(path, kRootNode, importOptions())));
}

TEST(SavedText, IsNeverTornFromItsArrays) {
    const Scratch scratch;
    const std::string path = savedYard(scratch);
    const std::string before = contentOf(path), first = arraysIn(scratch).at(0);
    const ImportedAspect scene = sphereOf(2);
    // Cut short before the text takes its place: there is room for the arrays, and none for a text with so many nodes.
    std::string many;
    for (int i = 0; i < 1000; ++i) many += fmt::format("\nnode {{ name: \"{:0>100}\" }}", i);
    const auto longOne = [&](const std::string& text) {
        const Scratch outside;
        Expected<ImportedScene> read = importScene(outside.write("o.tsct", text + many), kRootNode, importOptions());
        EXPECT_TRUE(read) << messageOf(read);
        return ImportedAspect(std::move(*read));
    };
    const auto saveShort = [&](const Aspect& what) {
        rlimit all{};
        EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &all), 0);
        const rlimit less{.rlim_cur = 60'000, .rlim_max = all.rlim_max};
        const auto handler = std::signal(SIGXFSZ, SIG_IGN);
        EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &less), 0);
        const Expected<void> saved = saveScene(path, what);
        EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &all), 0);
        std::signal(SIGXFSZ, handler);
        return saved ? std::string() : saved.error().message;
    };
    EXPECT_EQ(saveShort(*longOne("node { sphere { radius: 2 segments: 12 } }")),
              path + ": cannot write: File too large");
    EXPECT_EQ(contentOf(path), before);
    EXPECT_EQ(arraysIn(scratch), std::vector<std::string>{first});
    EXPECT_TRUE(importScene(path, kRootNode, importOptions()));
    // Nor do arrays go that were there before it.
    EXPECT_EQ(saveShort(*longOne(contentOf(scratch.path("authored.tsct")))), path + ": cannot write: File too large");
    EXPECT_EQ(arraysIn(scratch), std::vector<std::string>{first});
    EXPECT_TRUE(importScene(path, kRootNode, importOptions()));
    // What nobody names any more goes.
    std::string arrays;
    ASSERT_TRUE(saveScene(path, *scene, {}, &arrays));
    EXPECT_EQ(sortedFilesIn(scratch).size(), 3u);  // authored.tsct, too
    EXPECT_TRUE(std::filesystem::exists(arrays));
    EXPECT_TRUE(importScene(path, kRootNode, importOptions()));
    ASSERT_TRUE(saveScene(path, Aspect(), {}, &arrays));
    EXPECT_TRUE(arrays.empty());
    EXPECT_TRUE(arraysIn(scratch).empty());
}

/// A save leaves the arrays that any other file of the folder names.
TEST(SavedText, LeavesTheArraysOfItsCopies) {
    const ImportedAspect scene = sphereOf(2);
    const auto staysFor = [&](const std::string& copy, auto&& edit) {
        const Scratch scratch;
        const std::string path = savedYard(scratch), first = arraysIn(scratch).at(0);
        std::string text = contentOf(path);
        edit(text, first);
        scratch.write(copy, text);
        EXPECT_TRUE(saveScene(path, *scene));
        EXPECT_TRUE(importScene(path, kRootNode, importOptions()));
        return std::filesystem::exists(scratch.path(first));
    };
    const auto asItIs = [](std::string&, const std::string&) {};
    for (const char* copy : {"copy.tsct", "COPY.TSCT", "yard.tsct.bak", "yard.tsct~", "notes"})
        EXPECT_TRUE(staysFor(copy, asItIs)) << copy;
    EXPECT_TRUE(staysFor("copy.tsct", [](std::string& text, const std::string& name) {
        const std::string id = name.substr(name.size() - 23, 16);
        replaceOnce(text, fmt::format("file: \"{}\" id: \"{}\"", name, id),
                    fmt::format("id: \"{}\" file: '{}'", id, name));
    }));
    EXPECT_TRUE(staysFor("copy.tsct", [](std::string& text, const std::string&) {
        text.insert(0, "# " + std::string(2048, 'x') + "\n");
    }));
    EXPECT_FALSE(staysFor("other.tsct", [](std::string& text, const std::string&) { text = "node { }"; }));
    EXPECT_FALSE(staysFor("below/copy.tsct", asItIs)) << "there it has no arrays at all";
}

/// Nobody is at the other end, so opening it would wait for ever.
TEST(SavedText, WaitsForNoPipeBesideIt) {
    const Scratch scratch;
    const std::string path = savedYard(scratch);
    ASSERT_EQ(::mkfifo(scratch.path("pipe.tsct").c_str(), 0600), 0);
    std::filesystem::create_symlink("pipe.tsct", scratch.path("link.tsct"));
    EXPECT_FALSE(headOfText(scratch.path("pipe.tsct")));
    ASSERT_TRUE(saveScene(path, Aspect()));
    EXPECT_TRUE(arraysIn(scratch).empty());
}

TEST(SavedText, SavedByTwoAtOnceHasItsArrays) {
    const Scratch scratch;
    const std::string path = scratch.path("both.tsct");
    const ImportedAspect one = sphereOf(1), two = sphereOf(2);
    const auto saves = [&](const Aspect& first, const Aspect& second) {
        for (int i = 0; i < 2; ++i) EXPECT_TRUE(saveScene(path, i == 0 ? first : second));
    };
    for (int round = 0; round < 20; ++round) {
        std::thread other([&] { saves(*one, *two); });
        saves(*two, *one);
        other.join();
        const std::string name = arraysNamedIn(contentOf(path));
        ASSERT_FALSE(name.empty()) << round;
        ASSERT_EQ(arraysIn(scratch), std::vector<std::string>{name}) << round;
    }
}

/// Whoever may read a folder may hold its lock for ever.
TEST(SavedText, IsSavedWhereAStrangerHoldsTheLock) {
    const Scratch scratch;
    const std::string path = savedYard(scratch);
    const FileHandle stranger(::open(scratch.path("").c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    ASSERT_EQ(::flock(stranger.get(), LOCK_EX), 0);
    const std::string first = arraysIn(scratch).at(0);
    ASSERT_TRUE(saveScene(path, *sphereOf(2)));
    EXPECT_TRUE(importScene(path, kRootNode, importOptions()));
    EXPECT_TRUE(std::filesystem::exists(scratch.path(first)));
}

TEST(SavedText, ItsArraysTakeThePlaceOfALinkAndOfNoFolder) {
    const Scratch scratch;
    std::string arrays;
    const ImportedAspect scene = sphereOf(2);
    ASSERT_TRUE(saveScene(scratch.path("a.tsct"), *scene, {}, &arrays));
    const std::string foreign = scratch.write("foreign", "of somebody else");
    std::filesystem::remove(arrays);
    std::filesystem::create_symlink(foreign, arrays);
    ASSERT_TRUE(saveScene(scratch.path("a.tsct"), *scene));
    EXPECT_EQ(contentOf(foreign), "of somebody else");
    EXPECT_TRUE(importScene(scratch.path("a.tsct"), kRootNode, importOptions()));
    std::filesystem::remove(arrays);
    std::filesystem::create_directory(arrays);
    const Expected<void> refused = saveScene(scratch.path("a.tsct"), *scene);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, arrays + ": cannot write there: this is a folder, device, pipe or socket");
}

/// The flat form, which a scene with parts of a newer version keeps.
TEST(SavedText, TakesItsArraysAwayWhateverFormIsNext) {
    const Scratch scratch;
    const std::string path = savedYard(scratch);
    LaterParts later;
    later.ofFile = std::string("\xfa\x7d\x01x", 4);  // field 2015, a text
    std::string arrays = "from a call before";
    ASSERT_TRUE(saveScene(path, Aspect(), later, &arrays));
    EXPECT_NE(contentOf(path).find("later_file"), std::string::npos);
    EXPECT_TRUE(arrays.empty());
    EXPECT_TRUE(arraysIn(scratch).empty());
}

TEST(SavedText, TellsOfItsArraysAsItWasNamedItself) {
    const Scratch scratch;
    std::filesystem::create_directory(scratch.path("real"));
    std::filesystem::create_directory_symlink("real", scratch.path("link"));
    const std::string path = scratch.path("./link/a.tsct");
    const ImportedAspect scene = sphereOf(2);
    std::string first, second, third;
    ASSERT_TRUE(saveScene(path, *scene, {}, &first));
    ASSERT_TRUE(saveScene(path, *scene, {}, &second));
    EXPECT_TRUE(first.starts_with(scratch.path("./link/a."))) << first;
    EXPECT_EQ(second, first);
    // Where the text is a link itself they lie beside the file.
    std::filesystem::create_symlink("real/a.tsct", scratch.path("a.tsct"));
    ASSERT_TRUE(saveScene(scratch.path("a.tsct"), *scene, {}, &third));
    EXPECT_TRUE(third.starts_with(scratch.path("real/a."))) << third;
}

TEST(SavedText, WhatItNamesIsToldByItsHead) {
    const auto named = [](std::string_view head) { return arraysNamedIn(head); };
    EXPECT_EQ(named("saved { arrays { file: \"a.1.arrays\" id: \"1\" } node { } }"), "a.1.arrays");
    EXPECT_EQ(named("# arrays { file: \"b.arrays\" }\nnode { name: \"arrays { file: \" }\nsaved: { node { }\n"
                    "arrays: { id: '\\'file' file : 'a.arrays' "),
              "a.arrays");
    for (const char* none :
         {"", "saved {", "saved { arrays { file: \"a.arrays", "saved { arrays { file: \"a/b.arrays\" } }",
          "saved { arrays { file: \"../b.arrays\" } }", "saved { arrays { id: \"a.arrays\" } }",
          "saved { node { arrays { file: \"a.arrays\" } } }", "arrays { file: \"a.arrays\" }", "saved { arrays file"})
        EXPECT_EQ(named(none), "") << none;
}

/// What reading may take follows the arrays that a text names, not any that lie beside it.
TEST(SavedText, BoundsFollowItsOwnArrays) {
    const Scratch scratch;
    ImportOptions options = importOptions();
    options.maxResultBytes = 1;
    const std::string path = scratch.path("a.tsct");
    std::string arrays;
    ASSERT_TRUE(saveScene(path, *sphereOf(2), {}, &arrays));
    const Expected<ImportedScene> whole = importScene(path, kRootNode, options);
    EXPECT_TRUE(whole) << messageOf(whole);
    std::string wordy = "saved {";
    for (int i = 0; i < 1000; ++i) wordy += "node{}";
    scratch.write("wordy.tsct", wordy + "}");
    scratch.write("stranger.0123456789abcdef.arrays", std::string(1 << 20, 'x'));
    const Expected<ImportedScene> refused = importScene(scratch.path("wordy.tsct"), kRootNode, options);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit) << messageOf(refused);
}

TEST(SavedText, HoldsItsArraysWhereThereIsNoPlaceBeside) {
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(savedYard(scratch), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const Expected<std::string> text = writeScene(*aspect, SceneEncoding::kText);
    ASSERT_TRUE(text);
    EXPECT_GT(timesIn(*text, "\n  array: \""), 0u);
    const Scratch elsewhere;
    Expected<ImportedScene> again = editedText(elsewhere, *text);
    ASSERT_TRUE(again) << messageOf(again);
    EXPECT_EQ(structureDifference(*aspect, *ImportedAspect(std::move(*again))), "");
}

}  // namespace
}  // namespace tessera
